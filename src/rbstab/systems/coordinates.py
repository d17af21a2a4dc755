"""The coordinates of the motion of a system.

Each class defines the number of coordinates, their conversion to and from a motion, and, for a
given wrench, their rates and the force at the contact point.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from rbstab.mechanics import constraint, point, quaternion, reduced
from rbstab.mechanics.algebra import ZERO
from rbstab.mechanics.body import Body
from rbstab.mechanics.motion import (
    Motion,
    Turned,
    Wrench,
    applied_forces,
    contact_directions,
    free_rates,
    motion_from_centre,
    motion_from_contact,
)
from rbstab.mechanics.numbers import Array, Number
from rbstab.mechanics.states import OMEGA, THETA, V_OF_Z


class Coordinates:
    """The interface of all coordinates; `y` is the body's part of the state vector."""

    name: ClassVar[str]
    size: ClassVar[int] = 12
    holds_contact: ClassVar[bool] = False
    """Whether the contact point is held fixed, by a constraint and not by an element."""

    def from_motion(self, motion: Motion) -> Array:
        """Return the coordinates y of a motion, shape (size,)."""
        raise NotImplementedError

    def motion(self, body: Body, anchor: Array, y: Array) -> Motion:
        """Return the motion with these coordinates.

        Args:
            body: The body.
            anchor: X_a, shape (3,), m, inertial.
            y: The coordinates, shape (size,).
        """
        raise NotImplementedError

    def dynamics(self, body: Body, motion: Motion, wrench: Wrench) -> tuple[Array, Array]:
        """Return ẏ, shape (size,), and Λ on the body at C, shape (3,), N, inertial.

        Args:
            body: The body.
            motion: The motion with these coordinates.
            wrench: The forces of the elements on the body.
        """
        raise NotImplementedError


@dataclass(frozen=True, eq=False)
class CentreCoordinates(Coordinates):
    """Z = [Θ, Ω, X, V] under eq. 1."""

    name: ClassVar[str] = "Z"

    def from_motion(self, motion: Motion) -> Array:
        """Return Z."""
        return np.concatenate([motion.Theta, motion.Omega, motion.X, motion.V])

    def motion(self, body: Body, anchor: Array, y: Array, turned: Turned | None = None) -> Motion:
        """Return the motion at Z."""
        return motion_from_centre(body, anchor, y, turned)

    def dynamics(self, body: Body, motion: Motion, wrench: Wrench) -> tuple[Array, Array]:
        """Return Ż of eq. 1, and Λ of the elements."""
        return free_rates(body, motion, wrench), wrench.contact_force


@dataclass(frozen=True, eq=False)
class ContactCoordinates(Coordinates):
    """W = [Θ, Ω, E, F] under eq. 8."""

    name: ClassVar[str] = "W"

    def from_motion(self, motion: Motion) -> Array:
        """Return W (eq. 4, 38)."""
        return np.concatenate([motion.Theta, motion.Omega, motion.E, motion.F])

    def motion(self, body: Body, anchor: Array, y: Array) -> Motion:
        """Return the motion at W."""
        return motion_from_contact(body, anchor, y)

    def dynamics(self, body: Body, motion: Motion, wrench: Wrench) -> tuple[Array, Array]:
        """Return Ẇ of eq. 8, and Λ of the elements."""
        rates = free_rates(body, motion, wrench)
        # Ẇ = (∂W/∂Z)Ż, with Ė = F and Ḟ = c'Ż + AΩ̌²R (eq. 13).
        acceleration = point.acceleration(motion, body.contact_point, rates[OMEGA], rates[V_OF_Z])
        W_rate = np.concatenate([rates[THETA], rates[OMEGA], motion.F, acceleration])
        return W_rate, wrench.contact_force


@dataclass(frozen=True, eq=False)
class ReducedCoordinates(Coordinates):
    """[Θ, Ω] of the body held at its contact point, under eq. 21."""

    name: ClassVar[str] = "reduced"
    size: ClassVar[int] = 6
    holds_contact: ClassVar[bool] = True

    def from_motion(self, motion: Motion) -> Array:
        """Return [Θ, Ω]."""
        return np.concatenate([motion.Theta, motion.Omega])

    def motion(self, body: Body, anchor: Array, y: Array, turned: Turned | None = None) -> Motion:
        """Return the motion on the submanifold (eq. 32)."""
        return motion_from_contact(body, anchor, np.concatenate([y, ZERO, ZERO]), turned)

    def dynamics(self, body: Body, motion: Motion, wrench: Wrench) -> tuple[Array, Array]:
        """Return Θ̇ = BΩ with Ω̇ of eq. 21, and the force that holds the point (eq. 20)."""
        force, couple = wrench.force, wrench.couple
        Omega_rate = reduced.angular_acceleration(body, motion, force, couple)
        Lambda_ = reduced.holding_force(body, motion, force, Omega_rate)
        return np.concatenate([motion.B @ motion.Omega, Omega_rate]), Lambda_


@dataclass(frozen=True, eq=False)
class ManifoldCoordinates(CentreCoordinates):
    """All twelve states Z of the held body, under eq. 17. Motions must be on the submanifold.

    Args:
        baumgarte_rate: α, 1/s, the decay rate of drift off the submanifold; 0 for eq. 17 without
            drift control.
    """

    name: ClassVar[str] = "manifold"
    holds_contact: ClassVar[bool] = True

    baumgarte_rate: Number = 0.0

    def dynamics(self, body: Body, motion: Motion, wrench: Wrench) -> tuple[Array, Array]:
        """Return Ż = 𝒥⁻¹(𝓔 + cΛ) of eq. 17, and the force of constraint Λ (eq. 15)."""
        c = contact_directions(body, motion)
        applied = applied_forces(body, motion, wrench.force, wrench.couple)
        demand = constraint.baumgarte_demand(body, motion, self.baumgarte_rate)
        Lambda_ = constraint.constraint_force(body, c, applied, demand)
        return body.mass_matrix_inverse @ (applied + c @ Lambda_), Lambda_


@dataclass(frozen=True, eq=False)
class QuaternionCoordinates(Coordinates):
    """[r, ..., w]: other coordinates with r in place of Θ, and w after them; q = (w, r).

    q̇ = ½ q⊗(0, Ω) is regular everywhere. A is a rotation at any |q|, and Ȧ = AΩ̌, so a drift of |q|
    changes no motion. No element may read Θ or B.

    Args:
        angles: The coordinates with Θ.
    """

    name: ClassVar[str] = "quaternion"

    angles: CentreCoordinates | ReducedCoordinates

    @property
    def size(self) -> int:  # type: ignore[override]
        """One more than with Θ."""
        return self.angles.size + 1

    @property
    def holds_contact(self) -> bool:  # type: ignore[override]
        """That of the coordinates with Θ."""
        return self.angles.holds_contact

    def from_motion(self, motion: Motion) -> Array:
        """Return the coordinates of a motion with Θ."""
        return self.from_angles(self.angles.from_motion(motion))

    def from_angles(self, y: Array) -> Array:
        """Return the state vectors, shape (states + 1, ...), of such with Θ, (states, ...)."""
        w, r = quaternion.quaternion(y[THETA])
        return np.concatenate([r, y[OMEGA.start : self.angles.size], w, y[self.angles.size :]])

    def to_angles(self, y: Array, Theta: Array) -> Array:
        """Return the state vectors with Θ, shape (states, n), of such with q, (states + 1, n)."""
        size = self.angles.size
        return np.concatenate([Theta, y[OMEGA.start : size], y[size + 1 :]])

    def angles_along(
        self, y: Array, times: Array, start: Array, motions: Array
    ) -> tuple[Array, Array]:
        """Return Θ along m motions, with θ1 and θ3 continued, and the largest turns in doubt, rad.

        Args:
            y: The state vectors at any samples, or longer ones, shape (states, n).
            times: Their times, shape (n,), s.
            start: Θ at the first sample of each motion, shape (3, m), rad.
            motions: The motion of each sample: all numbers from 0 to m - 1, shape (n,).

        Returns:
            Θ, shape (3, n), and the turns of `quaternion.continued_angles`, shape (m,).
        """
        order = np.lexsort((times, motions))
        at = np.take(y[[*range(6), self.size - 1]], order, axis=1)
        t, motion = times[order], motions[order]
        first = np.flatnonzero(np.diff(motion, prepend=-1))
        Theta, turns = quaternion.continued_angles(at[-1], at[THETA], at[OMEGA], t, first, start)
        is_start = t == t[first][motion]
        Theta[:, is_start] = start[:, motion[is_start]]
        unsorted = np.empty_like(Theta)
        unsorted[:, order] = Theta
        return unsorted, turns

    def watched(self, y: Array) -> Array:
        """Return θ1, sin θ2 and θ3 at state vectors, and their rates, shape (2, 3, ...)."""
        return quaternion.turning(y[self.angles.size], y[THETA], y[OMEGA])

    def motion(self, body: Body, anchor: Array, y: Array) -> Motion:
        """Return the motion, with r and its rate matrix for Θ and B."""
        r, w = y[THETA], y[-1]
        turned = quaternion.rotation(w, r), quaternion.rate_matrix(w, r)
        return self.angles.motion(body, anchor, y[:-1], turned)

    def dynamics(self, body: Body, motion: Motion, wrench: Wrench) -> tuple[Array, Array]:
        """Return the rates of the coordinates with BΩ = ṙ and then ẇ = -½ r'Ω, and Λ."""
        rates, Lambda_ = self.angles.dynamics(body, motion, wrench)
        w_rate = -0.5 * (motion.Theta @ motion.Omega)
        return np.concatenate([rates, np.array([w_rate])]), Lambda_
