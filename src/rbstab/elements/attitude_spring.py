"""A spring of the attitude that needs no Euler angles: its energy is smooth for all rotations."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from rbstab.elements.declarations import Gain
from rbstab.elements.element import Element, couple_on_body
from rbstab.mechanics.algebra import IDENTITY, quadratic_form
from rbstab.mechanics.motion import Motion, Wrench
from rbstab.mechanics.numbers import Array, Number


@dataclass(frozen=True, eq=False, kw_only=True)
class AttitudeSpring(Element):
    """The energy ½ tr K(I - A), and a couple -LΩ; the energy is zero at A = I.

    Args:
        name: The name of the element in its config.
        K: Stiffness, shape (3, 3), N m.
        L: Damping, shape (3, 3), N m s/rad, body coordinates.
    """

    smooth = True
    gains: ClassVar[tuple[Gain, ...]] = (
        Gain("K", "N m", "stiffness of the attitude"),
        Gain("L", "N m s/rad", "damping, body", dissipates=True),
    )

    name: str
    K: Array
    L: Array

    def wrench(self, motion: Motion, states: Array) -> Wrench:
        """½ [M₂₃ - M₃₂, M₃₁ - M₁₃, M₁₂ - M₂₁] - LΩ with M = KA, N m, body.

        The energy changes at the rate -½ tr(K A Ω̌), which is minus this couple times Ω.
        """
        M = self.K @ motion.A
        skew = np.array([M[1, 2] - M[2, 1], M[2, 0] - M[0, 2], M[0, 1] - M[1, 0]])
        return couple_on_body(0.5 * skew - self.L @ motion.Omega)

    def stored(self, motion: Motion, states: Array) -> Number:
        """½ tr K(I - A), J."""
        return 0.5 * np.trace(self.K @ (IDENTITY - motion.A))

    def dissipated(self, motion: Motion, states: Array) -> Number:
        """Ω'LΩ, W."""
        return quadratic_form(self.L, motion.Omega)
