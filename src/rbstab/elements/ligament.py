"""A ligament: a line that only pulls, with a soft toe before its stiffness is reached."""

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from rbstab.elements.declarations import ANCHOR, POINT, Gain
from rbstab.elements.element import Element
from rbstab.elements.spring import Line, line, squared_length
from rbstab.mechanics.motion import Motion, Wrench
from rbstab.mechanics.numbers import Array, Number, square


@dataclass(frozen=True, eq=False, kw_only=True)
class Ligament(Element):
    """A line between two points that pulls when it is taut, with tension T(ε) + c dℓ/dt.

    With the strain ε = ℓ/ℓ₀ - 1: T = 0 for ε <= 0 (slack), T = k ε²/(4 ε_t) up to ε = 2 ε_t (the
    toe), and T = k(ε - ε_t) beyond. T and its derivative are continuous. The damper acts only on a
    taut line; on one that shortens fast, it can outweigh T close to ℓ₀.

    Its modes are m_t, 1 if it is taut, and m_b, 1 if it is beyond the toe.

    No switch can chatter: ε and its rate follow from positions and velocities alone, so they are
    the same before and after a switch. A line that goes taut has ε' > 0 on both sides, also with
    the jump c dℓ/dt of the tension; and where ε' = 0, nothing jumps.

    Args:
        name: The name of the element in its config.
        point: p, the point of the body, shape (3,), m, body coordinates, from the centre of
            gravity.
        anchor: The point of space, shape (3,), m, inertial.
        stiffness: k, N per unit of strain.
        slack_length: ℓ₀, m.
        toe_strain: ε_t.
        damping: c, N s/m.
        mode: [m_t, m_b], shape (2,), each 0 or 1.

    Source: L. Blankevoort and R. Huiskes, J. Biomech. Eng. 113 (1991) 263-269, for T.
    """

    gains: ClassVar[tuple[Gain, ...]] = (
        POINT,
        ANCHOR,
        Gain("stiffness", "N", "k, tension by strain beyond the toe", shape="number"),
        Gain("slack_length", "m", "ℓ₀, length up to which it is slack", shape="number"),
        Gain("toe_strain", "1", "ε_t, half of the strain at the end of the toe", shape="number"),
        Gain("damping", "N s/m", "c, tension by rate of length, if taut", "number", default=0.0),
    )
    mode_count: ClassVar[int] = 2

    name: str
    point: Array
    anchor: Array
    stiffness: Number
    slack_length: Number
    toe_strain: Number
    damping: Number
    mode: Array = field(default_factory=lambda: np.zeros(2))

    def guards(self, motion: Motion, states: Array) -> Array:
        """½((ℓ/ℓ₀)² - 1) and ½((ℓ/ℓ₀)² - (1 + 2 ε_t)²): zero where ε = 0 and ε = 2 ε_t."""
        ratio = squared_length(motion, self.point, self.anchor) / (
            self.slack_length * self.slack_length
        )
        end = 1.0 + 2.0 * self.toe_strain
        return np.array([0.5 * (ratio - 1.0), 0.5 * (ratio - end * end)])

    def wrench(self, motion: Motion, states: Array) -> Wrench:
        """-(T + c dℓ/dt) along the line if taut, N, inertial, at the point."""
        along, strain = self._line(motion), self._strain(motion)
        taut, beyond = self.mode
        toe = square(strain) / (4.0 * self.toe_strain)
        shape = toe + beyond * (strain - self.toe_strain - toe)
        tension = taut * (self.stiffness * shape + self.damping * along.rate)
        return along.pull(tension)

    def stored(self, motion: Motion, states: Array) -> Number:
        """ℓ₀ ∫ T dε, J."""
        return self.energy(self._strain(motion))

    def energy(self, strain: Number) -> Number:
        """ℓ₀ k ε³/(12 ε_t), beyond the toe ℓ₀ k ((ε - ε_t)²/2 + ε_t²/6), J: ε as in the modes."""
        end = self.toe_strain
        taut, beyond = self.mode
        toe = square(strain) * strain / (12.0 * end)
        linear = 0.5 * square(strain - end) + end * end / 6.0
        return taut * self.slack_length * self.stiffness * (toe + beyond * (linear - toe))

    def dissipated(self, motion: Motion, states: Array) -> Number:
        """c (dℓ/dt)² if taut, W."""
        rate = self._line(motion).rate
        return self.mode[0] * self.damping * square(rate)

    def _strain(self, motion: Motion) -> Number:
        """ε = ℓ/ℓ₀ - 1 of a taut line."""
        return self._line(motion).length / self.slack_length - 1.0

    def _line(self, motion: Motion) -> Line:
        """Return the line; to a slack one, which may have no length, ℓ₀² is added."""
        padding = (1.0 - self.mode[0]) * self.slack_length * self.slack_length
        return line(motion, self.point, self.anchor, padding)
