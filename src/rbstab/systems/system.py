"""A system: a body, its elements, its anchor, and the coordinates of its motion."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rbstab.elements.declarations import OwnState
from rbstab.elements.element import Element
from rbstab.mechanics.algebra import ZERO
from rbstab.mechanics.body import Body
from rbstab.mechanics.motion import Motion, Wrench
from rbstab.mechanics.numbers import Array, Number
from rbstab.systems.coordinates import Coordinates
from rbstab.systems.surface_forces import total_wrench, with_equivalent_forces

NO_HOLD = np.zeros(2)
NO_HOLD.flags.writeable = False

AUDIT_SIZE = 2
"""The number of audit states of a passive system: ∫v' dt, J, and ε, J (eq. 26). They follow all
other states, and are integrated together with them. If an element supplies power, ∫supplied dt, J,
is one more, before these two."""

LYAPUNOV_CHANGE = -2
"""The index of ∫v' dt in an audited state vector."""

CONTACT_WORK = -1
"""The index of ε in an audited state vector."""


@dataclass(frozen=True, eq=False)
class System:
    """The equations of motion of a body with its elements, for any kind of number.

    The state vector is the body's coordinates, then the own states of the elements in their order.

    Args:
        body: The body.
        elements: The elements, in the order of their parts and states.
        coordinates: The coordinates of the body's motion.
        anchor: X_a, shape (3,), m, inertial: the vector from the contact point at X = 0, Θ = 0
            to the point where E = 0 (eq. 38).
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
    def audited_size(self) -> int:
        """The number of states and of audit states."""
        return self.size + AUDIT_SIZE + self.supplies

    @property
    def supplies(self) -> bool:
        """Whether an element may supply power. If not, v cannot rise."""
        return any(element.supplies for element in self.elements)

    @property
    def timed(self) -> bool:
        """Whether the equations depend on the time."""
        return any(element.timed for element in self.elements)

    @property
    def parts(self) -> tuple[str, ...]:
        """The names of the energy parts: the body's kinetic energy, then each element."""
        return ("kinetic", *(element.name for element in self.elements))

    @property
    def declared_states(self) -> tuple[OwnState, ...]:
        """The own states of all elements, in the order of the state vector."""
        return tuple(state for element in self.elements for state in element.own_states)

    @property
    def own_states(self) -> dict[str, slice]:
        """The slices of the elements' own states in the state vector, by name."""
        slices, begin = {}, self.coordinates.size
        for state in self.declared_states:
            slices[state.name] = slice(begin, begin + state.size)
            begin += state.size
        return slices

    def start(self, motion: Motion, element_states: Array) -> Array:
        """Return the state vector of a motion and of the elements' own states, shape (size,)."""
        return np.concatenate([self.coordinates.from_motion(motion), element_states])

    def motion(self, y: Array, time: Number = 0.0) -> Motion:
        """Return the motion at a state vector and a time, s."""
        motion = self.coordinates.motion(self.body, self.anchor, y[: self.coordinates.size])
        return motion._replace(time=time)

    def rates(self, y: Array, time: Number = 0.0) -> Array:
        """Return ẏ, shape (size,)."""
        motion, pairs = self.acting(y, time)
        body_rates, _ = self.coordinates.dynamics(self.body, motion, total_wrench(motion, pairs))
        return np.concatenate([body_rates, *_state_rates(motion, pairs)])

    def audited_rates(self, y: Array, time: Number = 0.0) -> Array:
        """Return the rates of [y, ∫v' dt, ε]: ẏ, v' (eq. 29, 37, 43, 46) and ε̇ = F'Λ (eq. 26).

        F'Λ is the paper's (Ω'ŘA' + V')Λ. If an element supplies power, v' is what is supplied minus
        what is dissipated, and the rates are those of [y, ∫supplied dt, ∫v' dt, ε]. Shape
        (audited_size,); the rates do not depend on the audit states.
        """
        motion, pairs = self.acting(y, time)
        wrench = total_wrench(motion, pairs)
        body_rates, Lambda_ = self.coordinates.dynamics(self.body, motion, wrench)
        lyapunov_rate = -sum(element.dissipated(motion, states) for element, states in pairs)
        audit = [lyapunov_rate, motion.F @ Lambda_]
        if self.supplies:
            supplied = sum(element.supplied(motion, states) for element, states in pairs)
            audit = [supplied, supplied + lyapunov_rate, audit[-1]]
        return np.concatenate([body_rates, *_state_rates(motion, pairs), np.array(audit)])

    def observe(self, y: Array, time: Number = 0.0) -> "Observation":
        """Return what is observed at a state: motion, forces, energies and powers."""
        return Observation(self, y, time)

    def potential_energy(self, y: Array) -> Number:
        """Return the energy stored in all elements, J."""
        return self.stored_energy(self.motion(y), y)

    def stored_energy(self, motion: Motion, y: Array) -> Number:
        """Return the energy stored in all elements, J, of the motion at a state vector."""
        return sum(element.stored(motion, states) for element, states in self.with_states(y))

    def acting(self, y: Array, time: Number = 0.0) -> tuple[Motion, list[tuple[Element, Array]]]:
        """Return the motion, and each element with its own states.

        One that `holds` has its hold instead, and one that `slides` its equivalent forces.
        """
        motion, pairs = self.loads(y, time)
        if any(element.slides or element.holds for element in self.elements):
            pairs = with_equivalent_forces(self.body, self.coordinates, motion, pairs)
        return motion, pairs

    @property
    def clearance_owners(self) -> tuple[str, ...]:
        """The name of the element of each entry of `clearances`."""
        counts = ((element.name, element.clearance_count) for element in self.elements)
        return tuple(name for name, count in counts for _ in range(count))

    def clearances(self, y: Array) -> Array:
        """Return the functions of all elements that are zero where their statements end."""
        motion = self.motion(y)
        values = [
            element.clearances(motion) for element in self.elements if element.clearance_count
        ]
        return np.concatenate([np.zeros(0), *values])

    def loads(self, y: Array, time: Number = 0.0) -> tuple[Motion, list[tuple[Element, Array]]]:
        """Return the motion, and each element with its own states; without forces that hold."""
        return self.motion(y, time), self.with_states(y)

    def with_states(self, y: Array) -> list[tuple[Element, Array]]:
        """Return each element with its own states, or with zero equivalent forces, or no hold."""
        pairs, begin = [], self.coordinates.size
        for element in self.elements:
            states = y[begin : begin + element.state_size]
            if element.slides:
                states = ZERO
            elif element.holds:
                states = NO_HOLD
            pairs.append((element, states))
            begin += element.state_size
        return pairs


class Observation:
    """What is observed at a state, for any kind of number; it is computed when it is asked for.

    Args:
        system: The system.
        y: Its state vector; audit states may follow.
        time: The time, s.

    Attributes:
        own_states: The own states of all elements, one after the other.
    """

    def __init__(self, system: System, y: Array, time: Number = 0.0) -> None:
        self.system, self._y, self._time = system, y, time
        self.own_states = y[system.coordinates.size : system.size]

    @cached_property
    def motion(self) -> Motion:
        """The motion."""
        return self.system.motion(self._y, self._time)

    @cached_property
    def energy(self) -> Array:
        """The energy of each part, shape (parts,), J."""
        kinetic = self.system.body.kinetic_energy(self.motion.Omega, self.motion.V)
        pairs = self.system.with_states(self._y)
        return np.array(
            [kinetic, *(element.stored(self.motion, states) for element, states in pairs)]
        )

    @cached_property
    def _acting(self) -> list[tuple[Element, Array]]:
        return self.system.acting(self._y, self._time)[1]

    @cached_property
    def wrenches(self) -> tuple[Wrench, ...]:
        """The wrench of each element."""
        return tuple(element.wrench(self.motion, states) for element, states in self._acting)

    @cached_property
    def contact_force(self) -> Array:
        """Λ, shape (3,), N, inertial."""
        wrench = total_wrench(self.motion, self._acting)
        _, Lambda_ = self.system.coordinates.dynamics(self.system.body, self.motion, wrench)
        return Lambda_

    @cached_property
    def dissipation(self) -> Array:
        """The dissipation of each part, shape (parts,), W."""
        return self._powers("dissipated")

    @cached_property
    def supplied(self) -> Array:
        """The power that each part supplies, shape (parts,), W."""
        return self._powers("supplied")

    def _powers(self, kind: str) -> Array:
        pairs = self._acting
        return np.array(
            [0.0, *(getattr(element, kind)(self.motion, states) for element, states in pairs)]
        )

    def own_state(self, name: str) -> Array:
        """Return an own state of an element."""
        return self._y[self.system.own_states[name]]


def _state_rates(motion: Motion, pairs: list[tuple[Element, Array]]) -> list[Array]:
    return [element.rates(motion, states) for element, states in pairs if element.state_size]
