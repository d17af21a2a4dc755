"""The translational stabilizer H (eq. 24, 25)."""

from dataclasses import dataclass
from typing import ClassVar

from rbstab.elements.declarations import Gain
from rbstab.elements.element import Element, force_at_centre
from rbstab.mechanics.algebra import quadratic_form
from rbstab.mechanics.motion import Motion, Wrench
from rbstab.mechanics.numbers import Array, Number


@dataclass(frozen=True, eq=False)
class TranslationalStabilizer(Element):
    """H = -K_t X - L_t V at the centre of gravity (eq. 24).

    Args:
        K_t: Stiffness, shape (3, 3), N/m, inertial.
        L_t: Damping, shape (3, 3), N s/m, inertial.
    """

    smooth = True
    name = "translational stabilizer"
    gains: ClassVar[tuple[Gain, ...]] = (
        Gain("K_t", "N/m", "translational stiffness, inertial", default=0.0),
        Gain("L_t", "N s/m", "translational damping, inertial", dissipates=True, default=0.0),
    )

    K_t: Array
    L_t: Array

    def wrench(self, motion: Motion, states: Array) -> Wrench:
        """H = -K_t X - L_t V, N, inertial (eq. 24)."""
        return force_at_centre(-(self.K_t @ motion.X) - self.L_t @ motion.V)

    def stored(self, motion: Motion, states: Array) -> Number:
        """½ X'K_t X, J (eq. 25)."""
        return 0.5 * quadratic_form(self.K_t, motion.X)

    def dissipated(self, motion: Motion, states: Array) -> Number:
        """V'L_t V, W (eq. 29)."""
        return quadratic_form(self.L_t, motion.V)
