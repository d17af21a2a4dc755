"""The coordinates in which the motion of a system is written.

Each states how many numbers describe the body, the motion they stand for, and, under a wrench,
their rates together with the force at the contact point.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from rbstab.mechanics import constraint, coordinates, reduced
from rbstab.mechanics.algebra import ZERO
from rbstab.mechanics.body import Body
from rbstab.mechanics.motion import (
    Motion,
    Wrench,
    applied_forces,
    contact_directions,
    free_rates,
    motion_from_centre,
    motion_from_contact,
)
from rbstab.mechanics.numbers import Array, Number


class Coordinates:
    """What every choice of coordinates states. `y` is the body's part of the state vector."""

    name: ClassVar[str]
    size: ClassVar[int] = 12
    holds_contact: ClassVar[bool] = False
    """Whether the contact point is held fast: a restriction of the motion, not an element."""

    def of(self, motion: Motion) -> Array:
        """The coordinates y of a motion, shape (size,)."""
        raise NotImplementedError

    def motion(self, body: Body, anchor: Array, y: Array) -> Motion:
        """The motion that the coordinates stand for."""
        raise NotImplementedError

    def dynamics(self, body: Body, motion: Motion, wrench: Wrench) -> tuple[Array, Array]:
        """ẏ, of the shape of y, and Λ on the body at C, shape (3,), N, inertial."""
        raise NotImplementedError


@dataclass(frozen=True, eq=False)
class CentreCoordinates(Coordinates):
    """Z = [Θ, Ω, X, V] under eq. 1."""

    name: ClassVar[str] = "Z"

    def of(self, motion: Motion) -> Array:
        """Z."""
        return coordinates.centre_state(motion)

    def motion(self, body: Body, anchor: Array, y: Array) -> Motion:
        """The motion at Z."""
        return motion_from_centre(body, anchor, y)

    def dynamics(self, body: Body, motion: Motion, wrench: Wrench) -> tuple[Array, Array]:
        """Ż of eq. 1, and the elements' Λ."""
        return free_rates(body, motion, wrench), wrench.contact_force


@dataclass(frozen=True, eq=False)
class ContactCoordinates(Coordinates):
    """W = [Θ, Ω, E, F] under eq. 8."""

    name: ClassVar[str] = "W"

    def of(self, motion: Motion) -> Array:
        """W (eq. 4)."""
        return coordinates.contact_state(motion)

    def motion(self, body: Body, anchor: Array, y: Array) -> Motion:
        """The motion at W."""
        return motion_from_contact(body, anchor, y)

    def dynamics(self, body: Body, motion: Motion, wrench: Wrench) -> tuple[Array, Array]:
        """Ẇ of eq. 8, and the elements' Λ."""
        rates = free_rates(body, motion, wrench)
        return _contact_rates(body, motion, rates), wrench.contact_force


@dataclass(frozen=True, eq=False)
class PartlyHeldCoordinates(ContactCoordinates):
    """W = [Θ, Ω, E, F] where some axes of the contact point are held on a surface.

    Each held axis has Ë = -aF - bE. With a = κ and b = 0 the surface s = F + κE stays what it is;
    a = b = 0 holds E itself.

    Args:
        held: 1 for each held axis and 0 for each other, shape (3,).
        velocity_gain: a, 1/s.
        displacement_gain: b, 1/s².
    """

    name: ClassVar[str] = "W"

    held: Array
    velocity_gain: Number
    displacement_gain: Number = 0.0

    def dynamics(self, body: Body, motion: Motion, wrench: Wrench) -> tuple[Array, Array]:
        """Ẇ under the elements' Λ and the equivalent force of the held axes, and their sum."""
        c = contact_directions(body, motion)
        applied = applied_forces(body, motion, wrench.force, wrench.couple)
        applied = applied + c @ wrench.contact_force
        demand = constraint.centripetal_acceleration(body, motion)
        demand = demand + self.velocity_gain * motion.F + self.displacement_gain * motion.E
        force = constraint.partial_constraint_force(body, c, applied, demand, self.held)
        rates = body.mass_matrix_inverse @ (applied + c @ force)
        return _contact_rates(body, motion, rates), wrench.contact_force + force


def _contact_rates(body: Body, motion: Motion, rates: Array) -> Array:
    """Ẇ of Ż: (∂W/∂Z)Ż of eq. 8 carried out, so that Ė = F and Ḟ = c'Ż + AΩ̌²R (eq. 13)."""
    c = contact_directions(body, motion)
    acceleration = c.T @ rates + constraint.centripetal_acceleration(body, motion)
    return np.concatenate([rates[0:6], motion.F, acceleration])


@dataclass(frozen=True, eq=False)
class ReducedCoordinates(Coordinates):
    """[Θ, Ω] of the body held at its contact point, under eq. 21."""

    name: ClassVar[str] = "reduced"
    size: ClassVar[int] = 6
    holds_contact: ClassVar[bool] = True

    def of(self, motion: Motion) -> Array:
        """Θ and Ω."""
        return np.concatenate([motion.Theta, motion.Omega])

    def motion(self, body: Body, anchor: Array, y: Array) -> Motion:
        """The motion on the sub manifold (eq. 32)."""
        return motion_from_contact(body, anchor, np.concatenate([y, ZERO, ZERO]))

    def dynamics(self, body: Body, motion: Motion, wrench: Wrench) -> tuple[Array, Array]:
        """Θ̇ = BΩ with Ω̇ of eq. 21, and the force that holds the point (eq. 20)."""
        force, couple = wrench.force, wrench.couple
        Omega_rate = reduced.angular_acceleration(body, motion, force, couple)
        Lambda_ = reduced.holding_force(body, motion, force, Omega_rate)
        return np.concatenate([motion.B @ motion.Omega, Omega_rate]), Lambda_


@dataclass(frozen=True, eq=False)
class ManifoldCoordinates(Coordinates):
    """Z of the held body in all twelve states, under eq. 17.

    Args:
        baumgarte_rate: α, 1/s, at which drift off the sub manifold dies out; 0 for eq. 17 as it
            stands.
    """

    name: ClassVar[str] = "manifold"
    holds_contact: ClassVar[bool] = True

    baumgarte_rate: Number = 0.0

    def of(self, motion: Motion) -> Array:
        """Z of a motion, which has to lie on the sub manifold."""
        return coordinates.centre_state(motion)

    def motion(self, body: Body, anchor: Array, y: Array) -> Motion:
        """The motion at Z."""
        return motion_from_centre(body, anchor, y)

    def dynamics(self, body: Body, motion: Motion, wrench: Wrench) -> tuple[Array, Array]:
        """Ż of eq. 17, and the force of constraint (eq. 15)."""
        c = contact_directions(body, motion)
        applied = applied_forces(body, motion, wrench.force, wrench.couple)
        demand = constraint.baumgarte_demand(body, motion, self.baumgarte_rate)
        Lambda_ = constraint.constraint_force(body, c, applied, demand)
        return constraint.manifold_rates(body, c, applied, demand), Lambda_
