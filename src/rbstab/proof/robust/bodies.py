"""All bodies in a box: exactly one rest state each, a minimum, and a common level of v.

Where the bounds of a box of bodies decide nothing, it is halved along the number that widens them
most. The proof is complete when it holds for all parts. A counterexample is searched numerically;
what is found is proved for the exact numbers of the body.
"""

from contextlib import suppress
from dataclasses import dataclass
from enum import Enum
from fractions import Fraction
from functools import partial
from typing import NamedTuple

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.boxes import Box
from rbstab.proof.enclosures.bounds import BoundedEnergy
from rbstab.proof.model import NoMinimumError, energy_of
from rbstab.proof.reasons import NoEnergyReason, NoReducedEnergy
from rbstab.proof.robust.energies import energies_of
from rbstab.proof.robust.family import Family
from rbstab.proof.robust.numbers import Members, Part
from rbstab.proof.robust.part import IsLate, prove_part, starts_in_range
from rbstab.proof.search import Search
from rbstab.proof.zeros import Zero

PART_LIMIT = 32
"""The number of parts that are examined at most."""


OF_WIDE_BOXES = frozenset({NoEnergyReason.NOT_HELD, NoEnergyReason.DIVISOR})
"""The reasons that may not hold for the halves of a box."""


class BodiesOutcome(Enum):
    """How the proof for a box of bodies ended; the value is the text to show.

    NOT_PASSIVE says that its hypotheses do not hold for each body: it was not begun.
    """

    PROVED = "each body has one rest state, a minimum"
    SEVERAL = "a body in the box has several rest states"
    NO_MINIMUM = "a rest state of a body in the box is not a minimum"
    PART_LIMIT = "the limit on the number of parts was reached"
    TIME_LIMIT = "the time limit was reached"
    UNDECIDED = "the bounds of the one energy of all bodies decide nothing"
    NO_ENERGY = "the energy has no form that can be bounded"
    NOT_PASSIVE = "not decided"


class Counterexample(NamedTuple):
    """A body, as the numbers that have a tolerance, and its proved rest states, shape (n, 3), rad.

    With a single rest state, this one is proved not to be a minimum.
    """

    numbers: tuple[Fraction, ...]
    rest_states: Array


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
    level: float = 0.0
    parts: int = 0
    boxes: int = 0
    reason: str = ""
    false: Counterexample | None = None
    axis: int | None = None

    @property
    def proved(self) -> bool | None:
        """Whether the claim is proved, or false; None if it is not decided."""
        if self.outcome is BodiesOutcome.PROVED:
            return True
        return None if self.false is None else False


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
    pending, level, examined, boxes = [(box, Fraction(1))], np.inf, 0, 0
    done, share, first_axis = 0, Fraction(0), None

    def ended(
        outcome: BodiesOutcome, reason: str = "", false: Counterexample | None = None
    ) -> BodiesProof:
        if outcome in {BodiesOutcome.PART_LIMIT, BodiesOutcome.TIME_LIMIT}:
            reason = f"{len(pending)} of {len(pending) + done} parts are not proved"
            if done:
                percent = 100 * float(share)
                reason += f"; the claim is proved for {percent:.4g} % of the tolerances"
        lowest = level if outcome is BodiesOutcome.PROVED else 0.0
        return BodiesProof(outcome, lowest, examined, boxes, reason, false, first_axis)

    while pending:
        if examined == part_limit or is_late():
            late = examined < part_limit
            return ended(BodiesOutcome.TIME_LIMIT if late else BodiesOutcome.PART_LIMIT)
        part, size = pending.pop()
        examined, false = examined + 1, None
        try:
            family = Family(energies_of(members, part))
        except NoReducedEnergy as error:
            if not _may_have_energies(members, part, error):
                return ended(BodiesOutcome.NO_ENERGY, str(error))
            axis: int | None = _widest(part)
        else:
            part_proof = prove_part(family, is_late)
            boxes += part_proof.examined
            if part_proof.proved:
                level, done, share = min(level, part_proof.level), done + 1, share + size
                continue
            if is_late():
                pending.append((part, size))
                return ended(BodiesOutcome.TIME_LIMIT)
            false = counterexample(members, part, part_proof.doubtful, family)
            axis = _axis(family, part_proof.doubtful)
        first_axis = axis if examined == 1 else first_axis
        if false is not None:
            several = len(false.rest_states) > 1
            outcome = BodiesOutcome.SEVERAL if several else BodiesOutcome.NO_MINIMUM
            return ended(outcome, false=false)
        if axis is None:
            return ended(BodiesOutcome.UNDECIDED)
        pending += [(half, size / 2) for half in part.halves(axis)]
    return ended(BodiesOutcome.PROVED)


def _may_have_energies(members: Members, part: Part, error: NoReducedEnergy) -> bool:
    """Return whether the energies of smaller boxes may have a form that those of a box have not."""
    if error.reason in OF_WIDE_BOXES:
        with suppress(NoReducedEnergy):
            energies_of(members, part.without_width())
            return True
    return False


def _axis(family: Family, doubtful: Array) -> int | None:
    """Return the index of the number along which a box is halved; None if it does not matter."""
    points = doubtful[:4].T
    changes, bends = family.over(points, points).by_number()
    sizes = np.abs(np.concatenate([changes, bends.reshape(len(bends), 9, -1)], axis=1))
    total = sizes.sum(axis=0)
    scores = np.nan_to_num(sizes / np.where(total > 0, total, 1.0)).sum(axis=(1, 2))
    # If only inertia and damping vary, all bodies have one energy U, and those of halves have too.
    return int(scores.argmax()) if scores.any() else None


def _widest(part: Part) -> int:
    """Return the index of the number with the largest radius, relative to its size."""
    sizes = [
        radius / (abs(middle) + radius) if radius else Fraction(0)
        for middle, radius in zip(part.middle, part.radius, strict=True)
    ]
    return sizes.index(max(sizes))


@np.errstate(all="ignore")  # comparisons with NaN are false
def counterexample(
    members: Members, part: Part, doubtful: Array, family: Family
) -> Counterexample | None:
    """Look for a counterexample in a box: its middle, and its softest body.

    Args:
        members: Builds the system of a member.
        part: The box of bodies.
        doubtful: Points at which the gradient of some body may be zero, shape (n, 3), rad.
        family: The energies of the box.
    """
    starts = np.hstack([doubtful.T, starts_in_range()])
    for numbers in (part.middle, part.at(_softest(family, doubtful[:1].T))):
        zeros = _rest_states(members, numbers, starts)
        if len(zeros) > 1 or any(zero.index for zero in zeros):
            return Counterexample(numbers, np.array([zero.point for zero in zeros]))
    return None


def _rest_states(members: Members, numbers: tuple[Fraction, ...], starts: Array) -> list[Zero]:
    """Return proved rest states of a body in the range of eq. 5, from starts (3, points)."""
    try:
        U = energy_of(
            members.from_doubles([float(x) for x in numbers]), partial(members.exact, numbers)
        )
    except (NoMinimumError, TypeError):
        return []
    high = np.array([np.pi, np.pi / 2 if U.stop is None else float(U.stop), np.pi])
    search = Search(BoundedEnergy(U.U, free=U.free, least=U.least), Box(-high, high))
    return list(search.with_zeros_near(starts).zeros)


def _softest(family: Family, point: Array) -> list[int]:
    """Return z of the body whose ∇²U at a point is least along the softest axis of the middle."""
    at = family.over(point, point)
    soft = np.linalg.eigh(at.bend.middle[:, :3, 0])[1][:, 0]
    _, bends = at.by_number()
    changes = soft @ bends[..., 0] @ soft
    return (-np.sign(np.nan_to_num(changes))).astype(int).tolist()
