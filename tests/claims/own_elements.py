# mypy: ignore-errors
"""Elements of users for the random bodies of the table of claims."""

import numpy as np

from rbstab.elements import (
    ANCHOR,
    POINT,
    Element,
    Gain,
    OwnState,
    force_at,
    line,
    position,
    power,
    sqrt,
)


class Weight(Element):
    """A constant force f on a point of the body: the energy -f'(X + A p)."""

    gains = (POINT, Gain("force", "N", "f, inertial", shape="diagonal", positive=False))

    def wrench(self, motion, states):
        return force_at(motion, self.point, self.force)

    def stored(self, motion, states):
        return -(self.force @ position(motion, self.point))


class StiffeningSpring(Element):
    """A spring on a line: ½ k x² + ¼ h x⁴ with x = ℓ - ℓ₀."""

    gains = (
        POINT,
        ANCHOR,
        Gain("k", "N/m", "stiffness at rest", shape="number"),
        Gain("h", "N/m^3", "how it stiffens", shape="number"),
        Gain("length", "m", "ℓ₀", shape="number"),
    )

    def wrench(self, motion, states):
        along = line(motion, self.point, self.anchor)
        x = along.length - self.length
        tension = self.k * x + self.h * power(x, 3)
        return force_at(motion, self.point, -tension * along.direction)

    def stored(self, motion, states):
        x = line(motion, self.point, self.anchor).length - self.length
        return 0.5 * self.k * power(x, 2) + 0.25 * self.h * power(x, 4)


class CubicTie(Element):
    """A tie of a point along each inertial axis: ½ k e² + ¼ h e⁴."""

    gains = (
        POINT,
        ANCHOR,
        Gain("k", "N/m", "stiffness at rest", shape="diagonal"),
        Gain("h", "N/m^3", "how it stiffens", shape="diagonal"),
    )

    def wrench(self, motion, states):
        e = position(motion, self.point) - self.anchor
        return force_at(motion, self.point, -self.k * e - self.h * power(e, 3))

    def stored(self, motion, states):
        e = position(motion, self.point) - self.anchor
        return 0.5 * (self.k @ power(e, 2)) + 0.25 * (self.h @ power(e, 4))


class SofteningTie(Element):
    """A force towards a point that grows ever slower: k w (√(w² + e'e) - w)."""

    gains = (
        POINT,
        ANCHOR,
        Gain("k", "N/m", "stiffness at rest", shape="number"),
        Gain("width", "m", "w", shape="number"),
    )

    def wrench(self, motion, states):
        e = position(motion, self.point) - self.anchor
        return force_at(
            motion, self.point, -self.k * self.width / sqrt(self.width * self.width + e @ e) * e
        )

    def stored(self, motion, states):
        e = position(motion, self.point) - self.anchor
        return self.k * self.width * (sqrt(self.width * self.width + e @ e) - self.width)


class Rope(Element):
    """A line that pulls with k(ℓ - ℓ₀) where it is longer than ℓ₀."""

    gains = (
        POINT,
        ANCHOR,
        Gain("stiffness", "N/m", "k", shape="number"),
        Gain("length", "m", "ℓ₀", shape="number"),
    )
    mode_count = 1

    def guards(self, motion, states):
        return np.array([line(motion, self.point, self.anchor).length - self.length])

    def wrench(self, motion, states):
        along = line(motion, self.point, self.anchor)
        tension = self.mode[0] * self.stiffness * (along.length - self.length)
        return force_at(motion, self.point, -tension * along.direction)

    def stored(self, motion, states):
        extension = line(motion, self.point, self.anchor).length - self.length
        return 0.5 * self.stiffness * (self.mode[0] * power(extension, 2))


class CreepingCord(Element):
    """A spring k of a line in series with a spring K beside a damper c: D is its own state."""

    gains = (
        POINT,
        ANCHOR,
        Gain("k", "N/m", "stiffness of the spring", shape="number"),
        Gain("length", "m", "ℓ₀", shape="number"),
        Gain("slow", "N/m", "K, stiffness of the slow part", shape="number"),
        Gain("damping", "N s/m", "c", shape="number"),
    )
    states = (OwnState("creep", "D", "m", "how much longer the slow part is", size=1),)

    def extension(self, motion, states):
        return line(motion, self.point, self.anchor).length - self.length - states[0]

    def rates(self, motion, states):
        return (self.k * self.extension(motion, states) - self.slow * states) / self.damping

    def wrench(self, motion, states):
        along = line(motion, self.point, self.anchor)
        return force_at(
            motion, self.point, -self.k * self.extension(motion, states) * along.direction
        )

    def stored(self, motion, states):
        x = self.extension(motion, states)
        return 0.5 * self.k * power(x, 2) + 0.5 * self.slow * power(states[0], 2)

    def dissipated(self, motion, states):
        (rate,) = self.rates(motion, states)
        return self.damping * power(rate, 2)
