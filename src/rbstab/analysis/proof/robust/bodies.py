"""All bodies in a box: exactly one rest state each, a minimum, and a common level of v.

Where the bounds of a box of bodies decide nothing, it is halved along the number that widens them
most. The proof is complete when it holds for all parts.
"""

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from fractions import Fraction

import numpy as np

from rbstab.analysis.proof.reduced_energy import NoReducedEnergy
from rbstab.analysis.proof.robust.counterexample import Counterexample, counterexample
from rbstab.analysis.proof.robust.energies import Energies, energies_of, relevant
from rbstab.analysis.proof.robust.numbers import Members, Part
from rbstab.analysis.proof.robust.part import PartProof, most_disturbing, prove_part
from rbstab.analysis.proof.searches.zeros import search
from rbstab.mechanics.numbers import Array

PART_LIMIT = 32
"""The number of parts that are examined at most."""


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
    is_late: Callable[[], bool] = lambda: False,
) -> BodiesProof:
    """Prove that each body in a box has one rest state, a minimum, and bound its level.

    Args:
        members: Builds the system of a member.
        box: The box of bodies.
        part_limit: The number of parts that are examined at most.
        is_late: Returns whether no further part is to be examined.
    """
    try:
        search_ = _Search(members, box)
    except NoReducedEnergy as error:
        return BodiesProof(BodiesOutcome.NO_ENERGY, 0.0, 0, 0, str(error))
    return search_.run(part_limit, is_late)


class _Search:
    """The parts of one box that are not proved yet, and what is proved of the others."""

    def __init__(self, members: Members, box: Part) -> None:
        self.members = members
        # If the body in the middle has no energy of the right form, smaller boxes do not help.
        middle = energies_of(members, box.centre).family
        self.starts = search(middle)
        self.whole = relevant(members, box)
        self.pending = [(self.whole, self.starts[0] if len(self.starts) else np.zeros(3))]
        self.level, self.proved, self.examined, self.boxes = np.inf, 0, 0, 0
        self.share = Fraction(0)
        self.axis: int | None = None

    def run(self, part_limit: int, is_late: Callable[[], bool]) -> BodiesProof:
        """Examine the parts until all are proved, one is false, or a limit is reached."""
        while self.pending:
            if self.examined == part_limit:
                return self._ended(BodiesOutcome.PART_LIMIT)
            if is_late():
                return self._ended(BodiesOutcome.TIME_LIMIT)
            part, near = self.pending.pop()
            self.examined += 1
            false = self._examine(part, near)
            if false is not None:
                return false
        return self._ended(BodiesOutcome.PROVED)

    def _examine(self, part: Part, near: Array) -> BodiesProof | None:
        """Prove a part, or halve it; return a result if this ends the proof."""
        try:
            energies = energies_of(self.members, part)
        except NoReducedEnergy:
            return self._halve(part, near, _widest(part))
        proof = prove_part(energies.family, near)
        self.boxes += proof.examined
        if proof.proved:
            self.level, self.proved = min(self.level, proof.level), self.proved + 1
            self.share += part.share_of(self.whole)
            return None
        starts = np.concatenate([self.starts, proof.doubtful])
        false = counterexample(self.members, part, starts)
        return self._halve(part, near, _axis(energies, proof), false)

    def _halve(
        self, part: Part, near: Array, axis: int | None, false: Counterexample | None = None
    ) -> BodiesProof | None:
        """Halve a part that is not proved; return a result if this ends the proof.

        It does if a body in the part is `false`, or if halves would not help (`axis` is None).
        """
        if self.examined == 1:
            self.axis = axis
        if false is not None:
            several = len(false.rest_states) > 1
            outcome = BodiesOutcome.SEVERAL if several else BodiesOutcome.NO_MINIMUM
            return self._ended(outcome, false)
        if axis is None:
            return self._ended(BodiesOutcome.UNDECIDED)
        self.pending += [(half, near) for half in part.halves(axis)]
        return None

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


def _axis(energies: Energies, proof: PartProof) -> int | None:
    """Return the index of the number along which a part is halved; None if it does not matter.

    If only inertia and damping vary, all bodies have one energy U, and those of halves have too.
    """
    if not energies.varied:
        return None
    place = most_disturbing(energies.family, proof)
    return energies.varied[place] if place < len(energies.varied) else energies.varied[0]


def _widest(part: Part) -> int:
    """Return the index of the number with the largest radius, relative to its size."""
    sizes = [
        radius / (abs(middle) + radius) if radius else Fraction(0)
        for middle, radius in zip(part.middle, part.radius, strict=True)
    ]
    return sizes.index(max(sizes))
