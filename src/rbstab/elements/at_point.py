"""Connectors between any point of the body and any point of space."""

from dataclasses import dataclass

from rbstab.elements.element import Element
from rbstab.mechanics import point
from rbstab.mechanics.motion import Motion, Wrench
from rbstab.mechanics.numbers import Array, Number


@dataclass(frozen=True, eq=False, kw_only=True)
class AtPoint(Element):
    """A connector that acts at a point of its own instead of the contact point.

    It stands before the connector among the bases of a class. The connector then gets the
    displacement and the velocity of this point as E and F, and its force acts at this point.

    Args:
        name: The name of the element in its config.
        point: The point of the body, shape (3,), m, body coordinates, from the centre of gravity.
        anchor: The point of space where its displacement is zero, shape (3,), m, inertial.
    """

    name: str
    point: Array
    anchor: Array

    def at_point(self, motion: Motion) -> Motion:
        """Return the motion with E and F of the point: X + A p - anchor, and its derivative."""
        displacement = point.position(motion, self.point) - self.anchor
        return motion._replace(E=displacement, F=point.velocity(motion, self.point))

    def wrench(self, motion: Motion, states: Array) -> Wrench:
        """Return the force of the connector, at the point."""
        force = super().wrench(self.at_point(motion), states).contact_force
        return point.force_at(motion, self.point, force)

    def stored(self, motion: Motion, states: Array) -> Number:
        """Return the stored energy of the connector, J."""
        return super().stored(self.at_point(motion), states)

    def dissipated(self, motion: Motion, states: Array) -> Number:
        """Return the power that the connector dissipates, W."""
        return super().dissipated(self.at_point(motion), states)

    def rates(self, motion: Motion, states: Array) -> Array:
        """Return the derivatives of the own states of the connector."""
        return super().rates(self.at_point(motion), states)

    def guards(self, motion: Motion, states: Array) -> Array:
        """Return the event functions of the connector."""
        return super().guards(self.at_point(motion), states)
