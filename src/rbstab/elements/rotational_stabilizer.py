"""The rotational stabilizer N (eq. 23, 25)."""

from dataclasses import dataclass
from typing import ClassVar

from rbstab.elements.declarations import Gain
from rbstab.elements.element import Element, couple_on_body
from rbstab.mechanics.algebra import quadratic_form
from rbstab.mechanics.motion import Motion, Wrench
from rbstab.mechanics.numbers import Array, Number


@dataclass(frozen=True, eq=False)
class RotationalStabilizer(Element):
    """N = -B'(Θ) K_r Θ - L_r Ω (eq. 23).

    Args:
        K_r: Stiffness, shape (3, 3), N m/rad, in the Euler angles.
        L_r: Damping, shape (3, 3), N m s/rad, body coordinates.
    """

    smooth = True
    name = "rotational stabilizer"
    gains: ClassVar[tuple[Gain, ...]] = (
        Gain("K_r", "N m/rad", "rotational stiffness, Euler angles", default=0.0),
        Gain("L_r", "N m s/rad", "rotational damping, body", dissipates=True, default=0.0),
    )

    K_r: Array
    L_r: Array

    def wrench(self, motion: Motion, states: Array) -> Wrench:
        """N = -B'K_r Θ - L_r Ω, N m, body (eq. 23)."""
        return couple_on_body(-(motion.B.T @ (self.K_r @ motion.Theta)) - self.L_r @ motion.Omega)

    def stored(self, motion: Motion, states: Array) -> Number:
        """½ Θ'K_r Θ, J (eq. 25)."""
        return 0.5 * quadratic_form(self.K_r, motion.Theta)

    def dissipated(self, motion: Motion, states: Array) -> Number:
        """Ω'L_r Ω, W (eq. 29)."""
        return quadratic_form(self.L_r, motion.Omega)
