"""All bodies in a box: exactly one rest state each, a minimum, and a common level of v.

Where the bounds of a box of bodies decide nothing, it is halved along the number that widens them
most. The proof is complete when it holds for all parts.
"""

from dataclasses import dataclass
from enum import Enum
from fractions import Fraction
from functools import cached_property

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.reasons import NoEnergyReason, NoReducedEnergy
from rbstab.proof.robust.counterexample import (
    Counterexample,
    counterexample,
    proved_rest_states,
)
from rbstab.proof.robust.family import Family
from rbstab.proof.robust.forms import forms_of
from rbstab.proof.robust.numbers import Members, Part
from rbstab.proof.robust.part import IsLate, PartProof, lowest_near, prove_part

PART_LIMIT = 32
"""The number of parts that are examined at most."""


OF_WIDE_BOXES = frozenset({NoEnergyReason.NOT_HELD, NoEnergyReason.DIVISOR})
"""The reasons that may not hold for the halves of a box."""


class BodiesOutcome(Enum):
    """How the proof for a box of bodies ended; the value is the text to show."""

    PROVED = "each body has one rest state, a minimum"
    SEVERAL = "a body in the box has several rest states"
    NO_MINIMUM = "a rest state of a body in the box is not a minimum"
    PART_LIMIT = "the limit on the number of parts was reached"
    TIME_LIMIT = "the time limit was reached"
    UNDECIDED = "the bounds of the one energy of all bodies decide nothing"
    NO_ENERGY = "the energy has no form that can be bounded"


@dataclass(frozen=True, eq=False)
class BodiesProof:
    """What is proved for all bodies in a box.

    level, J, is a lower bound of the level of each body's certified region: 0 if nothing is proved.
    parts is the number of boxes of bodies into which the box was cut, and boxes the number of boxes
    of Θ that were examined. reason says more on the outcome. false is a body that shows that the
    claim is false. axis is the index of the number that widens the bounds of the whole box most, if
    they decided nothing; None otherwise.
    """

    outcome: BodiesOutcome
    level: float
    parts: int
    boxes: int
    reason: str = ""
    false: Counterexample | None = None
    axis: int | None = None


def prove_bodies(
    members: Members,
    box: Part,
    part_limit: int = PART_LIMIT,
    is_late: IsLate = lambda: False,
) -> BodiesProof:
    """Prove that each body in a box has one rest state, a minimum, and bound its level.

    Args:
        members: Builds the system of a member.
        box: The box of bodies.
        part_limit: The number of parts that are examined at most.
        is_late: Returns whether no further part is to be examined.
    """
    pending, proved, examined, boxes = [box], 0, 0, 0
    level, share, first_axis = np.inf, Fraction(0), None

    def ended(
        outcome: BodiesOutcome, reason: str = "", false: Counterexample | None = None
    ) -> BodiesProof:
        if outcome in {BodiesOutcome.PART_LIMIT, BodiesOutcome.TIME_LIMIT}:
            reason = f"{len(pending)} of {len(pending) + proved} parts are not proved"
            if proved:
                percent = 100 * float(share)
                reason += f"; the claim is proved for {percent:.4g} % of the tolerances"
        lowest = level if outcome is BodiesOutcome.PROVED else 0.0
        return BodiesProof(outcome, lowest, examined, boxes, reason, false, first_axis)

    try:
        # If the body in the middle has no energy of the right form, smaller boxes do not help.
        known = _Known(members, box, Family(forms_of(members, box.without_width())))
    except NoReducedEnergy as error:
        return ended(BodiesOutcome.NO_ENERGY, str(error))
    while pending:
        if examined == part_limit or is_late():
            late = examined < part_limit
            return ended(BodiesOutcome.TIME_LIMIT if late else BodiesOutcome.PART_LIMIT)
        part, examined, false = pending.pop(), examined + 1, None
        try:
            family = Family(forms_of(members, part))
        except NoReducedEnergy as error:
            if error.reason not in OF_WIDE_BOXES:
                return ended(BodiesOutcome.NO_ENERGY, str(error))
            axis: int | None = _widest(part)
        else:
            found = prove_part(family, known.near, is_late)
            boxes += found.examined
            if found.proved:
                level, proved = min(level, found.level), proved + 1
                share += part.share_of(box)
                continue
            if is_late():
                pending.append(part)
                return ended(BodiesOutcome.TIME_LIMIT)
            starts = np.concatenate([known.zeros, found.doubtful])
            false = counterexample(members, part, starts, family)
            axis = _axis(family, part, found)
        first_axis = axis if examined == 1 else first_axis
        if false is not None or axis is None:
            outcome = BodiesOutcome.UNDECIDED
            if false is not None:
                several = len(false.rest_states) > 1
                outcome = BodiesOutcome.SEVERAL if several else BodiesOutcome.NO_MINIMUM
            return ended(outcome, false=false)
        pending += part.halves(axis)
    return ended(BodiesOutcome.PROVED)


@dataclass(frozen=True, eq=False)
class _Known:
    """What is known of the body in the middle of a box."""

    members: Members
    box: Part
    middle: Family

    @cached_property
    def zeros(self) -> Array:
        """Its proved rest states, from a grid of starts, shape (n, 3), rad."""
        zeros = proved_rest_states(self.members, self.box.middle, _grid())
        return np.array([zero.point for zero in zeros]).reshape(-1, 3)

    @cached_property
    def near(self) -> Array:
        """Its rest state, or a point from where it is looked for."""
        found = lowest_near(self.middle, np.zeros(3))
        return np.vstack([self.zeros, np.zeros(3)])[0] if found is None else found


def _grid() -> Array:
    """Return points from which the rest states of the body in the middle are looked for."""
    lines = [np.linspace(-a, a, n) for a, n in ((2.8, 5), (1.3, 3), (2.8, 5))]
    return np.stack([x.ravel() for x in np.meshgrid(*lines, indexing="ij")], axis=1)


def _axis(family: Family, part: Part, proof: PartProof) -> int | None:
    """Return the index of the number along which a part is halved; None if it does not matter.

    If only inertia and damping vary, all bodies have one energy U, and those of halves have too.
    """
    _, slopes, bends = family.gradients(proof.doubtful[:4].T)
    sizes = np.abs(np.concatenate([slopes, bends], axis=1))
    total = sizes.sum(axis=0)
    scores = np.nan_to_num(sizes / np.where(total > 0, total, 1.0)).sum(axis=(1, 2))
    moved = [k in family.forms.used and bool(r) for k, r in enumerate(part.radius)]
    return int(np.where(moved, scores, -1).argmax()) if any(moved) else None


def _widest(part: Part) -> int:
    """Return the index of the number with the largest radius, relative to its size."""
    sizes = [
        radius / (abs(middle) + radius) if radius else Fraction(0)
        for middle, radius in zip(part.middle, part.radius, strict=True)
    ]
    return sizes.index(max(sizes))
