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
from rbstab.proof.zeros import Zero

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
    try:
        search = _Search(members, box)
    except NoReducedEnergy as error:
        return BodiesProof(BodiesOutcome.NO_ENERGY, 0.0, 0, 0, str(error))
    return search.run(part_limit, is_late)


class _Search:
    """The parts of one box that are not proved yet, and what is proved of the others."""

    def __init__(self, members: Members, box: Part) -> None:
        self.members, self.whole = members, box
        # If the body in the middle has no energy of the right form, smaller boxes do not help.
        self.middle = Family(forms_of(members, box.without_width()))
        self.pending = [box]
        self.level, self.proved, self.examined, self.boxes = np.inf, 0, 0, 0
        self.share = Fraction(0)
        self.axis: int | None = None

    @cached_property
    def zeros(self) -> list[Zero]:
        """Proved rest states of the body in the middle, from a grid of starts."""
        return proved_rest_states(self.members, self.whole.middle, _grid())

    @cached_property
    def near(self) -> Array:
        """The rest state of the body in the middle, or a point from where it is looked for."""
        found = lowest_near(self.middle, np.zeros(3))
        if found is not None:
            return found
        return self.zeros[0].point if self.zeros else np.zeros(3)

    def run(self, part_limit: int, is_late: IsLate) -> BodiesProof:
        """Examine the parts until all are proved, one is false, or a limit is reached."""
        while self.pending:
            if self.examined == part_limit:
                return self._ended(BodiesOutcome.PART_LIMIT)
            if is_late():
                return self._ended(BodiesOutcome.TIME_LIMIT)
            part = self.pending.pop()
            self.examined += 1
            ended = self._examine(part, is_late)
            if ended is not None:
                return ended
        return self._ended(BodiesOutcome.PROVED)

    def _examine(self, part: Part, is_late: IsLate) -> BodiesProof | None:
        """Prove a part, or halve it; return a result if this ends the proof."""
        try:
            family = Family(forms_of(self.members, part))
        except NoReducedEnergy as error:
            if error.reason not in OF_WIDE_BOXES:
                return BodiesProof(
                    BodiesOutcome.NO_ENERGY, 0.0, self.examined, self.boxes, str(error)
                )
            return self._halve(part, _widest(part))
        proof = prove_part(family, self.near, is_late)
        self.boxes += proof.examined
        if proof.proved:
            self.level, self.proved = min(self.level, proof.level), self.proved + 1
            self.share += part.share_of(self.whole)
            return None
        if is_late():
            self.pending.append(part)
            return self._ended(BodiesOutcome.TIME_LIMIT)
        starts = np.array([zero.point for zero in self.zeros]).reshape(-1, 3)
        starts = np.concatenate([starts, proof.doubtful])
        false = counterexample(self.members, part, starts, family)
        return self._halve(part, _axis(family, part, proof), false)

    def _halve(
        self, part: Part, axis: int | None, false: Counterexample | None = None
    ) -> BodiesProof | None:
        """Halve a part that is not proved; return a result if this ends the proof.

        It does if a body in the part is `false`, or if halves would not help (`axis` is None).
        """
        if self.examined == 1:
            self.axis = axis
        if false is not None:
            return self._false(false)
        if axis is None:
            return self._ended(BodiesOutcome.UNDECIDED)
        self.pending += part.halves(axis)
        return None

    def _false(self, false: Counterexample) -> BodiesProof:
        several = len(false.rest_states) > 1
        return self._ended(BodiesOutcome.SEVERAL if several else BodiesOutcome.NO_MINIMUM, false)

    def _ended(self, outcome: BodiesOutcome, false: Counterexample | None = None) -> BodiesProof:
        level = self.level if outcome is BodiesOutcome.PROVED else 0.0
        reason = ""
        if outcome in {BodiesOutcome.PART_LIMIT, BodiesOutcome.TIME_LIMIT}:
            parts = len(self.pending) + self.proved
            reason = f"{len(self.pending)} of {parts} parts are not proved"
            if self.proved:
                percent = 100 * float(self.share)
                reason += f"; the claim is proved for {percent:.4g} % of the tolerances"
        return BodiesProof(outcome, level, self.examined, self.boxes, reason, false, self.axis)


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
