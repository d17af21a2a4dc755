"""Rest states on SO(3): what a list of them has, and Morse's check of it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.mechanics.quaternion import rotation
from rbstab.proof.zeros import Zero

FAMILY = "rest states seem to form a family"

FAMILIES = "rest states form families"

DIMENSION = 3
"""That of SO(3): indices are 0 to 3."""


@dataclass(frozen=True, eq=False)
class RestRotation:
    """One rest state: a rotation where the energy is stationary, and alone in this.

    Args:
        quaternion: A unit quaternion near it, w first, shape (4,).
        radius: A bound on its distance from that of the rest state.
        index: The number of independent directions in which the energy falls, proved.
        low: A lower bound of its energy, J.
        high: An upper bound.
        chart: The chart in which it was proved; -1 for an eigenvector.
        zero: The zero in this chart.
    """

    quaternion: Array
    radius: float
    index: int
    low: float
    high: float
    chart: int = -1
    zero: Zero | None = None

    @property
    def energy(self) -> float:
        """Its energy, J."""
        return 0.5 * self.low + 0.5 * self.high

    @property
    def rotation(self) -> Array:
        """A, shape (3, 3), to round-off."""
        return rotation(self.quaternion[0], self.quaternion[1:])


@dataclass(frozen=True, eq=False)
class Family:
    """Rest states of one energy that form a curve, a surface, or all rotations.

    Args:
        low: A lower bound of their energy, J.
        high: An upper bound.
        index: The number of independent directions in which the energy falls.
        dimension: 1 for a curve, 2 for a surface, 3 for all rotations.
    """

    low: float
    high: float
    index: int
    dimension: int

    @property
    def energy(self) -> float:
        """Their energy, J."""
        return 0.5 * self.low + 0.5 * self.high


@dataclass(frozen=True, eq=False)
class Rotations:
    """The rest states among all rotations, in the order of their energies.

    Args:
        states: The isolated ones.
        examined: The number of boxes that were examined; 0 if none was needed.
        why: Why the list is not complete; empty if it is.
        families: Families of rest states, where all rest states are known exactly.
        share: The share of the charts that is decided.
    """

    states: tuple[RestRotation, ...]
    examined: int
    why: str = ""
    families: tuple[Family, ...] = ()
    share: float = 1.0

    @property
    def is_family(self) -> bool:
        """Whether rest states are known, or seem, to form families."""
        return bool(self.families) or self.why.startswith(FAMILY) or self.why.endswith(FAMILIES)

    @property
    def proved(self) -> bool:
        """Whether `states` are proved to be all rest states, with their indices."""
        return not self.why and not self.families

    @property
    def counts(self) -> list[int]:
        """The number of states of each index, from 0 to 3."""
        return counts_of([state.index for state in self.states])

    @property
    def level(self) -> float:
        """c, J: a lower bound of the energies of all but isolated minima; -inf without others.

        Each component of {U < c} has one rest state, a minimum: SO(3) is compact, without a border.
        """
        others = [state.low for state in self.states if state.index]
        return min([*others, *(family.low for family in self.families)], default=-np.inf)


def counts_of(indices: Sequence[int]) -> list[int]:
    """Return how many of some indices are 0, 1, 2 and 3."""
    return [sum(index == k for index in indices) for k in range(DIMENSION + 1)]


def against_morse(indices: Sequence[int]) -> str:
    """Return why some indices are not those of all regular rest states on SO(3); "" if they may be.

    Over the numbers modulo 2, SO(3) has one class of homology in each dimension 0 to 3. So a
    function with regular Hessians has a stationary point of each index, and as the Euler
    characteristic is 0, Σ (-1)^index = 0 (Morse).
    """
    counts = counts_of(indices)
    missing = [str(k) for k, count in enumerate(counts) if not count]
    if missing:
        return f"no rest state of index {' or '.join(missing)} was found, and there must be one"
    if counts[0] - counts[1] + counts[2] - counts[3]:
        return f"{counts} rest states of index 0 to 3 cannot be all of them"
    return ""
