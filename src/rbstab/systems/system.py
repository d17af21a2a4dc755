"""A system: one body, its elements, its anchor, and the coordinates of its motion."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rbstab.elements.element import Element
from rbstab.mechanics.algebra import ZERO
from rbstab.mechanics.body import Body
from rbstab.mechanics.motion import Motion, Wrench
from rbstab.mechanics.numbers import Array, Number
from rbstab.systems.coordinates import Coordinates

NO_WRENCH = Wrench(ZERO, ZERO, ZERO)

AUDIT_SIZE = 2
"""The states that the audit adds: ∫v' dt and ε (eq. 26)."""


class Observation(NamedTuple):
    """What a state means, each of shape (3,) but for `energy` and `dissipation` (parts,)."""

    motion: Motion
    connector_state: Array
    wrenches: tuple[Wrench, ...]
    contact_force: Array
    energy: Array
    dissipation: Array


@dataclass(frozen=True, eq=False)
class System:
    """The equations of a body with its elements, for any kind of number.

    The state vector is the body's coordinates, then the elements' own states in their order.

    Args:
        body: The body.
        elements: The elements, in the order of their parts and states.
        coordinates: The coordinates of the body's motion.
        anchor: X_a, shape (3,), m, inertial: where the contact point belongs, from its place at
            X = 0, Θ = 0 (eq. 38).
    """

    body: Body
    elements: tuple[Element, ...]
    coordinates: Coordinates
    anchor: Array

    @property
    def size(self) -> int:
        """The number of states."""
        return self.coordinates.size + sum(element.state_size for element in self.elements)

    @property
    def parts(self) -> tuple[str, ...]:
        """The names of the energy parts: the body's kinetic energy, then each element."""
        return ("kinetic", *(element.name for element in self.elements))

    def start(self, motion: Motion, own: Array) -> Array:
        """The state vector of a motion and the elements' own states, shape (size,)."""
        return np.concatenate([self.coordinates.of(motion), own])

    def motion(self, y: Array) -> Motion:
        """The motion at a state vector."""
        return self.coordinates.motion(self.body, self.anchor, y[: self.coordinates.size])

    def rates(self, y: Array) -> Array:
        """ẏ, shape (size,)."""
        motion, pairs = self.motion(y), self._with_states(y)
        body_rates, _ = self.coordinates.dynamics(self.body, motion, _total_wrench(motion, pairs))
        return np.concatenate([body_rates, *_own_rates(motion, pairs)])

    def audited_rates(self, y: Array) -> Array:
        """The rates of [y, ∫v' dt, ε]: ẏ, v' (eq. 29, 37, 43, 46) and ε̇ = F'Λ (eq. 26).

        F'Λ is the paper's (Ω'ŘA' + V')Λ. Shape (size + 2,); the two audit states are not read.
        """
        motion, pairs = self.motion(y), self._with_states(y)
        wrench = _total_wrench(motion, pairs)
        body_rates, Lambda_ = self.coordinates.dynamics(self.body, motion, wrench)
        lyapunov_rate = -sum(element.dissipated(motion, own) for element, own in pairs)
        audit = np.array([lyapunov_rate, motion.F @ Lambda_])
        return np.concatenate([body_rates, *_own_rates(motion, pairs), audit])

    def observe(self, y: Array) -> Observation:
        """Everything that a state means: motion, forces, energies and dissipations by part."""
        motion, pairs = self.motion(y), self._with_states(y)
        wrench = _total_wrench(motion, pairs)
        _, Lambda_ = self.coordinates.dynamics(self.body, motion, wrench)
        kinetic = self.body.kinetic_energy(motion.Omega, motion.V)
        return Observation(
            motion,
            y[self.coordinates.size : self.size],
            tuple(element.wrench(motion, own) for element, own in pairs),
            Lambda_,
            np.array([kinetic, *(element.stored(motion, own) for element, own in pairs)]),
            np.array([0.0, *(element.dissipated(motion, own) for element, own in pairs)]),
        )

    def potential_energy(self, y: Array) -> Number:
        """The sum of what the elements store, J."""
        motion = self.motion(y)
        return sum(element.stored(motion, own) for element, own in self._with_states(y))

    def _with_states(self, y: Array) -> list[tuple[Element, Array]]:
        pairs, begin = [], self.coordinates.size
        for element in self.elements:
            pairs.append((element, y[begin : begin + element.state_size]))
            begin += element.state_size
        return pairs


def _total_wrench(motion: Motion, pairs: list[tuple[Element, Array]]) -> Wrench:
    force, couple, contact_force = NO_WRENCH
    for element, own in pairs:
        wrench = element.wrench(motion, own)
        force, couple = force + wrench.force, couple + wrench.couple
        contact_force = contact_force + wrench.contact_force
    return Wrench(force, couple, contact_force)


def _own_rates(motion: Motion, pairs: list[tuple[Element, Array]]) -> list[Array]:
    return [element.rates(motion, own) for element, own in pairs if element.state_size]
