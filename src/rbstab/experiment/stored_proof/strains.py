"""The strains of ligaments at the rest states of a proof."""

from typing import TYPE_CHECKING

import numpy as np

from rbstab.analysis.proof.boxes import Boxes
from rbstab.analysis.proof.ligaments.free import FreeLigaments
from rbstab.analysis.proof.ligaments.free_bounds import squares_over
from rbstab.analysis.proof.ligaments.held import LigamentLine
from rbstab.analysis.proof.ligaments.law import MARGIN, LigamentEnergy
from rbstab.analysis.proof.lines.intervals import Intervals
from rbstab.analysis.proof.lines.over_boxes import at_centres, over_boxes
from rbstab.analysis.proof.trigonometric import TrigonometricForm

if TYPE_CHECKING:
    from rbstab.experiment.stored_proof.proof import Proof, ProvedState


def may_be_just_taut(proof: "Proof", state: "ProvedState") -> list[bool]:
    """Return of each ligament whether its strain may be zero at a proved rest state.

    Args:
        proof: The proof; its energy has the ligaments in the order of the elements.
        state: The rest state; what is returned holds for all of its enclosure.
    """
    box = _box(state.enclosure)
    found = list[bool]()
    for line in () if proof.reduced_energy is None else proof.reduced_energy.form.lines:
        if isinstance(line, LigamentLine):
            found.append(_reaches(line.law, _over(line.square, box)))
        elif isinstance(line, FreeLigaments):
            laws = (one.law for one in line.ligaments)
            found += map(_reaches, laws, squares_over(line, box))
    return found


def _over(form: TrigonometricForm, box: Boxes) -> Intervals:
    """Return bounds on a form over a box."""
    return over_boxes(at_centres(form, form.basis(box.centre), box), box.radius)[0]


def _reaches(law: LigamentEnergy, square: Intervals) -> bool:
    """Return whether the square of a length may be that of the slack length."""
    slack = law.slack_length**2
    above, below = square.low > slack * (1 + 4 * MARGIN), square.high < slack * (1 - 4 * MARGIN)
    return not np.all(above | below)


def _box(corners: tuple[tuple[float, ...], tuple[float, ...]]) -> Boxes:
    low, high = np.array(corners)
    return Boxes(low[np.newaxis], high[np.newaxis])
