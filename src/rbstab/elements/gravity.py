"""Gravity (eq. 1, 27)."""

from dataclasses import dataclass

from rbstab.elements.element import Element, force_at_centre
from rbstab.mechanics.motion import Motion, Wrench
from rbstab.mechanics.numbers import Array, Number


@dataclass(frozen=True, eq=False)
class Gravity(Element):
    """The weight G = m g at the centre of gravity; it stores p = -G'X (eq. 27), zero at X = 0.

    Args:
        weight: G, shape (3,), N, inertial.
    """

    smooth = True
    name = "gravity"

    weight: Array

    def wrench(self, motion: Motion, states: Array) -> Wrench:
        """G at the centre of gravity (eq. 1)."""
        return force_at_centre(self.weight)

    def stored(self, motion: Motion, states: Array) -> Number:
        """p = -G'X, J: eq. 27 integrated for a constant G."""
        return -(self.weight @ motion.X)
