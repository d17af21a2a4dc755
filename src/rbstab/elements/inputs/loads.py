"""Inputs: forces and couples on the body that come from outside, and supply power.

An input stores nothing and dissipates nothing. So v may rise: v' is the power of all inputs minus
what the other elements dissipate. The exception is a force that never changes: it has an energy, as
a weight has, and is no such input.
"""

from dataclasses import dataclass
from typing import ClassVar

from rbstab.elements.declarations import POINT, Gain
from rbstab.elements.element import Element, couple_on_body
from rbstab.elements.inputs.signals import Driven
from rbstab.mechanics import point
from rbstab.mechanics.motion import Motion, Wrench
from rbstab.mechanics.numbers import Array, Number


def _amplitude(unit: str) -> Gain:
    return Gain("amplitude", unit, "a, load where the signal is 1", "number", positive=False)


_INERTIAL = Gain("direction", "1", "d, direction, inertial; of any length", "direction")
_BODY = Gain("direction", "1", "d, direction, body coordinates; of any length", "direction")


@dataclass(frozen=True, eq=False, kw_only=True)
class Input(Driven):
    """A load a s(t) d on the body, with an amplitude a, a signal s and a direction d.

    Args:
        name: The name of the element in its config.
        direction: d, a unit vector, shape (3,).
        amplitude: a, N or N m.
    """

    name: str
    direction: Array
    amplitude: Number

    def load(self, motion: Motion) -> Array:
        """Return a s(t) d, shape (3,), N or N m."""
        return (self.amplitude * self.signal.value(motion.time)) * self.direction

    def supplied(self, motion: Motion, states: Array) -> Number:
        """f'V + n'Ω, W: the power of the force f and of the couple n about the centre."""
        wrench = self.wrench(motion, states)
        return wrench.force @ motion.V + wrench.couple @ motion.Omega


@dataclass(frozen=True, eq=False, kw_only=True)
class ForceInput(Input):
    """A force at a point of the body, whose direction is fixed in space.

    Args:
        point: p, shape (3,), m, body coordinates, from the centre of gravity.
    """

    gains: ClassVar[tuple[Gain, ...]] = (POINT, _INERTIAL, _amplitude("N"))

    point: Array

    def wrench(self, motion: Motion, states: Array) -> Wrench:
        """a s(t) d, N, inertial, at the point."""
        return point.force_at(motion, self.point, self.load(motion))


@dataclass(frozen=True, eq=False, kw_only=True)
class ConstantForce(Element):
    """A force f = a d at a point of the body that never changes; it stores -f'(X + A p).

    Args:
        name: The name of the element in its config.
        direction: d, a unit vector, shape (3,), inertial.
        amplitude: a, N.
        point: p, shape (3,), m, body coordinates, from the centre of gravity.
    """

    smooth = True
    gains: ClassVar[tuple[Gain, ...]] = ForceInput.gains

    name: str
    direction: Array
    amplitude: Number
    point: Array

    def wrench(self, motion: Motion, states: Array) -> Wrench:
        """a d, N, inertial, at the point."""
        return point.force_at(motion, self.point, self.amplitude * self.direction)

    def stored(self, motion: Motion, states: Array) -> Number:
        """-f'(X + A p), J: the force is minus its slope."""
        return -((self.amplitude * self.direction) @ point.position(motion, self.point))


@dataclass(frozen=True, eq=False, kw_only=True)
class BodyForceInput(Input):
    """A force at a point of the body that turns with the body.

    Args:
        point: p, shape (3,), m, body coordinates, from the centre of gravity.
    """

    gains: ClassVar[tuple[Gain, ...]] = (POINT, _BODY, _amplitude("N"))

    point: Array

    def wrench(self, motion: Motion, states: Array) -> Wrench:
        """A (a s(t) d), N, inertial, at the point."""
        return point.force_at(motion, self.point, motion.A @ self.load(motion))


@dataclass(frozen=True, eq=False, kw_only=True)
class CoupleInput(Input):
    """A couple whose direction is fixed in space."""

    gains: ClassVar[tuple[Gain, ...]] = (_INERTIAL, _amplitude("N m"))

    def wrench(self, motion: Motion, states: Array) -> Wrench:
        """A'(a s(t) d), N m, body coordinates."""
        return couple_on_body(motion.A.T @ self.load(motion))


@dataclass(frozen=True, eq=False, kw_only=True)
class BodyCoupleInput(Input):
    """A couple that turns with the body."""

    gains: ClassVar[tuple[Gain, ...]] = (_BODY, _amplitude("N m"))

    def wrench(self, motion: Motion, states: Array) -> Wrench:
        """a s(t) d, N m, body coordinates."""
        return couple_on_body(self.load(motion))
