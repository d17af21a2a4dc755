"""A spring with a damper, along the line between a point of the body and a point of space."""

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

from rbstab.elements.declarations import ANCHOR, POINT, Gain
from rbstab.elements.element import Element
from rbstab.mechanics import point
from rbstab.mechanics.motion import Motion, Wrench
from rbstab.mechanics.numbers import Array, Number, sqrt


class Line(NamedTuple):
    """A line from a point of space to a point of the body.

    Attributes:
        direction: The unit vector along it, shape (3,), inertial.
        length: ℓ, m.
        rate: dℓ/dt, m/s.
    """

    direction: Array
    length: Number
    rate: Number


def line(motion: Motion, body_point: Array, anchor: Array) -> Line:
    """Return the line from an anchor to a point of the body; it must have a length.

    With e = X + A p - anchor: ℓ = √(e'e), and dℓ/dt = e'ė/ℓ.

    Args:
        motion: The motion of the body.
        body_point: p, shape (3,), m, body coordinates, from the centre of gravity.
        anchor: Shape (3,), m, inertial.
    """
    e = point.position(motion, body_point) - anchor
    length = sqrt(e @ e)
    direction = e / length
    return Line(direction, length, direction @ point.velocity(motion, body_point))


@dataclass(frozen=True, eq=False, kw_only=True)
class Spring(Element):
    """A force k(ℓ - ℓ₀) + c dℓ/dt that pulls the body along a line, and pushes if it is negative.

    Args:
        name: The name of the element in its config.
        point: p, the point of the body, shape (3,), m, body coordinates, from the centre of
            gravity.
        anchor: The point of space, shape (3,), m, inertial.
        stiffness: k, N/m.
        rest_length: ℓ₀, m.
        damping: c, N s/m.
    """

    gains: ClassVar[tuple[Gain, ...]] = (
        POINT,
        ANCHOR,
        Gain("stiffness", "N/m", "k, force by extension", shape="number"),
        Gain("rest_length", "m", "ℓ₀, length without force", shape="number"),
        Gain("damping", "N s/m", "c, force by rate of length", shape="number", default=0.0),
    )

    name: str
    point: Array
    anchor: Array
    stiffness: Number
    rest_length: Number
    damping: Number

    def wrench(self, motion: Motion, own: Array) -> Wrench:
        """-(k(ℓ - ℓ₀) + c dℓ/dt) along the line, N, inertial, at the point."""
        along = line(motion, self.point, self.anchor)
        tension = self.stiffness * (along.length - self.rest_length) + self.damping * along.rate
        return point.force_at(motion, self.point, -tension * along.direction)

    def stored(self, motion: Motion, own: Array) -> Number:
        """½ k(ℓ - ℓ₀)², J."""
        extension = line(motion, self.point, self.anchor).length - self.rest_length
        return 0.5 * self.stiffness * extension * extension

    def dissipated(self, motion: Motion, own: Array) -> Number:
        """c (dℓ/dt)², W."""
        rate = line(motion, self.point, self.anchor).rate
        return self.damping * rate * rate
