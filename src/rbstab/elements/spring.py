"""A spring with a damper, along the line between a point of the body and a point of space."""

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from rbstab.elements.declarations import ANCHOR, POINT, Gain
from rbstab.elements.element import Element
from rbstab.mechanics import point
from rbstab.mechanics.algebra import ZERO, cross, squared_norm
from rbstab.mechanics.motion import Motion, Wrench
from rbstab.mechanics.numbers import Array, Number, sqrt, square

NO_LENGTH = 1e-5
"""A line is taken to have no length below this fraction of its length without force: its direction
is about to be undefined."""


class Line(NamedTuple):
    """A line from a point of space to a point of the body.

    Attributes:
        displacement: e, from the point of space to the point of the body, shape (3,), m, inertial.
        moment: p × A'e, shape (3,), m², body: the couple of a force e at the point.
        length: ℓ, m.
        rate: dℓ/dt, m/s.
    """

    displacement: Array
    moment: Array
    length: Number
    rate: Number

    @property
    def direction(self) -> Array:
        """The unit vector e/ℓ along the line, shape (3,), inertial."""
        return self.displacement / self.length

    def pull(self, tension: Number) -> Wrench:
        """Return the wrench of a tension, N, that pulls the point of the body to that of space."""
        by_length = -tension / self.length
        return Wrench(by_length * self.displacement, by_length * self.moment, ZERO)


def line(motion: Motion, body_point: Array, anchor: Array, padding: Number | None = None) -> Line:
    """Return the line from an anchor to a point of the body; it must have a length.

    With e = X + A p - anchor: ℓ = √(e'e), and dℓ/dt = e'ė/ℓ = (e'V + (p × A'e)'Ω)/ℓ. So the vector
    that gives the couple also gives the rate, and the velocity of the point is not needed.

    Args:
        motion: The motion of the body.
        body_point: p, shape (3,), m, body coordinates, from the centre of gravity.
        anchor: Shape (3,), m, inertial.
        padding: Added to e'e, m², where nothing depends on the line, so that it has a length.
    """
    e = point.position(motion, body_point) - anchor
    moment = cross(body_point, motion.A.T @ motion.X - motion.A.T @ anchor)
    squared = squared_norm(e)
    length = sqrt(squared if padding is None else squared + padding)
    return Line(e, moment, length, (e @ motion.V + moment @ motion.Omega) / length)


def squared_length(motion: Motion, body_point: Array, anchor: Array) -> Number:
    """Return e'e of `line`, m²; it is smooth also where the line has no length.

    Args:
        motion: The motion of the body.
        body_point: As `line`.
        anchor: As `line`.
    """
    return squared_norm(point.position(motion, body_point) - anchor)


@dataclass(frozen=True, eq=False, kw_only=True)
class Spring(Element):
    """A force k(ℓ - ℓ₀) + c dℓ/dt that pulls the body along a line, and pushes if it is negative.

    Where the line has no length it has no direction, and the force is not defined. With ℓ₀ = 0 and
    c = 0 the force is -k e, which is (`ZeroLengthSpring`).

    Args:
        name: The name of the element in its config.
        point: p, the point of the body, shape (3,), m, body coordinates, from the centre of
            gravity.
        anchor: The point of space, shape (3,), m, inertial.
        stiffness: k, N/m.
        rest_length: ℓ₀, m.
        damping: c, N s/m.
    """

    smooth = True
    gains: ClassVar[tuple[Gain, ...]] = (
        POINT,
        ANCHOR,
        Gain("stiffness", "N/m", "k, force by extension", shape="number"),
        Gain("rest_length", "m", "ℓ₀, length without force", shape="number", or_zero=True),
        Gain("damping", "N s/m", "c, force by rate of length", shape="number", default=0.0),
    )
    clearance_count: ClassVar[int] = 1

    name: str
    point: Array
    anchor: Array
    stiffness: Number
    rest_length: Number
    damping: Number

    def wrench(self, motion: Motion, states: Array) -> Wrench:
        """-(k(ℓ - ℓ₀) + c dℓ/dt) along the line, N, inertial, at the point."""
        along = line(motion, self.point, self.anchor)
        tension = self.stiffness * (along.length - self.rest_length) + self.damping * along.rate
        return along.pull(tension)

    def stored(self, motion: Motion, states: Array) -> Number:
        """½ k(ℓ - ℓ₀)², J."""
        extension = line(motion, self.point, self.anchor).length - self.rest_length
        return 0.5 * self.stiffness * square(extension)

    def dissipated(self, motion: Motion, states: Array) -> Number:
        """c (dℓ/dt)², W."""
        rate = line(motion, self.point, self.anchor).rate
        return self.damping * square(rate)

    def clearances(self, motion: Motion) -> Array:
        """(ℓ² - ε²ℓ₀²)/(ℓ² + ℓ₀²) with ε = `NO_LENGTH`: at most 1, and zero where ℓ = εℓ₀."""
        squared = squared_length(motion, self.point, self.anchor)
        rest = self.rest_length * self.rest_length
        return np.array([(squared - NO_LENGTH * NO_LENGTH * rest) / (squared + rest)])


@dataclass(frozen=True, eq=False, kw_only=True)
class ZeroLengthSpring(Element):
    """A spring whose rest length is zero, and that has no damper: a force -k e, everywhere smooth.

    With e = X + A p - anchor. It is `Spring` with ℓ₀ = 0 and c = 0, but its formulas need no
    direction, so it may have no length.

    Args:
        name: The name of the element in its config.
        point: p, the point of the body, shape (3,), m, body coordinates, from the centre of
            gravity.
        anchor: The point of space, shape (3,), m, inertial.
        stiffness: k, N/m.
    """

    smooth = True
    gains: ClassVar[tuple[Gain, ...]] = Spring.gains[:3]

    name: str
    point: Array
    anchor: Array
    stiffness: Number

    def wrench(self, motion: Motion, states: Array) -> Wrench:
        """-k e, N, inertial, at the point."""
        e = point.position(motion, self.point) - self.anchor
        return point.force_at(motion, self.point, -self.stiffness * e)

    def stored(self, motion: Motion, states: Array) -> Number:
        """½ k e'e, J."""
        return 0.5 * self.stiffness * squared_length(motion, self.point, self.anchor)
