"""A guard of the range of the Euler angles (eq. 5): its energy is infinite at the ends."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from rbstab.elements.declarations import Gain
from rbstab.elements.element import Element, couple_on_body
from rbstab.mechanics.motion import Motion, Wrench
from rbstab.mechanics.numbers import Array, Number, cos, sin


def energy_of_tangent(stiffness: Number, tangent: Number) -> Number:
    """Return ½ k tan² θ2, J: the part of the energy that proofs take apart from the rest."""
    return 0.5 * stiffness * tangent * tangent


@dataclass(frozen=True, eq=False, kw_only=True)
class Barrier(Element):
    """The energy ½ k tan² θ2, and, where wanted, ½ k_o tan²(θ/2) of θ1 and of θ3.

    Args:
        name: The name of the element in its config.
        stiffness: k, N m.
        outer_stiffness: k_o, N m; 0 for a guard of θ2 alone.
    """

    smooth = True
    gains: ClassVar[tuple[Gain, ...]] = (
        Gain("stiffness", "N m", "k of ½ k tan² θ2", shape="number"),
        Gain(
            "outer_stiffness",
            "N m",
            "k of ½ k tan²(θ/2) for θ1 and θ3",
            shape="number",
            default=0.0,
        ),
    )

    name: str
    stiffness: Number
    outer_stiffness: Number

    def wrench(self, motion: Motion, states: Array) -> Wrench:
        """-B' ∂U/∂Θ, N m, body.

        The derivative of ½ tan² θ2 is s₂/c₂³, and that of ½ tan²(θ/2) is s/(1 + c)².
        """
        (s1, s2, s3), (c1, c2, c3) = sin(motion.Theta), cos(motion.Theta)
        gradient = np.array(
            [
                self.outer_stiffness * s1 / ((1.0 + c1) * (1.0 + c1)),
                self.stiffness * s2 / (c2 * c2 * c2),
                self.outer_stiffness * s3 / ((1.0 + c3) * (1.0 + c3)),
            ]
        )
        return couple_on_body(-(motion.B.T @ gradient))

    def stored(self, motion: Motion, states: Array) -> Number:
        """½ k tan² θ2 + ½ k_o ((1 - c₁)/(1 + c₁) + (1 - c₃)/(1 + c₃)), J."""
        (_, s2, _), (c1, c2, c3) = sin(motion.Theta), cos(motion.Theta)
        outer = (1.0 - c1) / (1.0 + c1) + (1.0 - c3) / (1.0 + c3)
        return energy_of_tangent(self.stiffness, s2 / c2) + 0.5 * self.outer_stiffness * outer
