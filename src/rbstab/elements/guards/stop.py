"""A hard stop of θ2: the body bounces from it, or rests against it."""

import math
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from rbstab.elements.declarations import Gain
from rbstab.elements.element import Element, couple_on_body
from rbstab.mechanics import pitch
from rbstab.mechanics.motion import Motion, Wrench
from rbstab.mechanics.numbers import Array, Number
from rbstab.mechanics.states import PITCH


@dataclass(frozen=True, eq=False, kw_only=True)
class Stop(Element):
    """A stop that keeps |θ2| <= θ_e, with restitution e.

    Where θ2 reaches ±θ_e with a rate θ̇2⁻, an impulse acts on θ2 alone. It makes θ̇2⁺ = -e θ̇2⁻, and
    takes away the energy ½ (1 - e²) (θ̇2⁻)²/μ. Here μ = b'M⁻¹b is the acceleration θ̈2 by a unit of
    couple on θ2. A body may also rest against the stop: then a couple τ on θ2 keeps θ̈2 = 0, as long
    as it presses towards the inside.

    Its modes are m₊, 1 while the body rests at θ2 = θ_e, and m₋, 1 while it rests at θ2 = -θ_e. In
    the methods `states` is the hold [τ, α] (`Element.holds`).

    Args:
        name: The name of the element in its config.
        angle: θ_e, rad.
        restitution: e, between 0 (plastic) and 1 (elastic).
        mode: [m₊, m₋], shape (2,), each 0 or 1.
    """

    gains: ClassVar[tuple[Gain, ...]] = (
        Gain("angle", "rad", "θ_e, largest |θ2|", shape="number", below=math.pi / 2),
        Gain(
            "restitution",
            "1",
            "e, rate of θ2 after an impact by the rate before",
            shape="number",
            positive=False,
            at_most=1.0,
        ),
    )
    mode_count: ClassVar[int] = 2
    holds: ClassVar[bool] = True

    name: str
    angle: Number
    restitution: Number
    mode: Array = field(default_factory=lambda: np.zeros(2))

    def guards(self, motion: Motion, states: Array) -> Array:
        """θ2 - θ_e and -θ2 - θ_e, rad; α and -α, rad/s², on a side where the body rests."""
        angle, acceleration = motion.Theta[PITCH], states[1]
        beyond = np.array([angle - self.angle, -angle - self.angle])
        pressing = np.array([acceleration, -acceleration])
        return (1.0 - self.mode) * beyond + self.mode * pressing

    def wrench(self, motion: Motion, states: Array) -> Wrench:
        """(m₊ + m₋) τ b, N m, body."""
        return couple_on_body((self.mode[0] + self.mode[1]) * states[0] * pitch.direction(motion))

    def impulse(self, rate: Number, mobility: Number) -> Number:
        """Return the impulse on θ2 of an impact, N m s: -(1 + e) θ̇2⁻/μ.

        Args:
            rate: θ̇2⁻, rad/s.
            mobility: μ, 1/(kg m²).
        """
        return -(1.0 + self.restitution) * rate / mobility

    def lost_energy(self, rate: Number, mobility: Number) -> Number:
        """Return the energy that an impact takes away, J: ½ (1 - e²) (θ̇2⁻)²/μ.

        Args:
            rate: θ̇2⁻, rad/s.
            mobility: μ, 1/(kg m²).
        """
        e = self.restitution
        return 0.5 * (1.0 - e * e) * rate * rate / mobility
