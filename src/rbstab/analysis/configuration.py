"""The configurations of a system at rest, and its stored energy in each of them."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from rbstab.elements.inputs.loads import Input
from rbstab.elements.inputs.signals import Driven, Leg
from rbstab.integrate.straight_line.equations import StraightLine
from rbstab.integrate.switching.phase import depend_on_loads
from rbstab.mechanics.algebra import ZERO
from rbstab.mechanics.derivatives import jacobian
from rbstab.mechanics.motion import Motion
from rbstab.mechanics.numbers import Array, Number
from rbstab.mechanics.states import PITCH
from rbstab.systems.coordinates import CentreCoordinates, ReducedCoordinates
from rbstab.systems.modes import Modes, guards_at, has_modes, with_modes, with_modes_at
from rbstab.systems.schedule import with_legs
from rbstab.systems.system import System

ORIENTATION = slice(0, 3)
"""Θ in a configuration q."""

POSITION = slice(3, 6)
"""X in a configuration q of a body that is not held."""


@dataclass(frozen=True, eq=False)
class Configurations:
    """All configurations q of a system at rest: [Θ, X, own states], or [Θ, own states] if held.

    At rest, the coordinates W and Z are equivalent, and so are `manifold` and `reduced`. So
    `system` uses only Z or `reduced`. If its elements switch, each configuration has its own modes.

    Args:
        system: The system, in coordinates Z, or reduced ones if the contact point is held.
    """

    system: System

    @cached_property
    def held(self) -> bool:
        """Whether the contact point is held, so that Θ alone fixes the body's position."""
        return self.system.coordinates.holds_contact

    @cached_property
    def pose_size(self) -> int:
        """The number of entries of q that place the body; the rest are the elements' own states."""
        return 3 if self.held else 6

    @cached_property
    def size(self) -> int:
        """The number of entries of q."""
        return self.pose_size + self.system.size - self.system.coordinates.size

    @cached_property
    def unloaded(self) -> Array:
        """Θ = 0, X = X_a, own states 0, shape (size,)."""
        placed = np.concatenate([np.zeros(3), self.system.anchor])[: self.pose_size]
        return np.concatenate([placed, np.zeros(self.size - self.pose_size)])

    def state(self, q: Array) -> Array:
        """Return the state vector of `system` at rest in the configuration q."""
        positions = [q[ORIENTATION], ZERO]
        if not self.held:
            positions += [q[POSITION], ZERO]
        return np.concatenate([*positions, q[self.pose_size :]])

    def placed(self, q: Array) -> Array:
        """Return q with the entries that count."""
        return q

    def spring(self, q: Array) -> Number:
        """Return the energy, J, of what keeps the entries of q that do not count."""
        return 0

    def configuration(self, motion: Motion, element_states: Array) -> Array:
        """Return the configuration q of a motion and of the elements' own states."""
        pose = [motion.Theta] if self.held else [motion.Theta, motion.X]
        return np.concatenate([*pose, element_states])

    def motion(self, q: Array) -> Motion:
        """Return the motion at rest in the configuration q."""
        return self.system.motion(self.state(q))

    def energy(self, q: Array) -> Number:
        """Return the energy stored in the elements, and in what keeps θ2, J."""
        return sum(self.energies(q).tolist()) + self.spring(q)

    def energies(self, q: Array) -> Array:
        """Return the energy stored in each element, shape (elements,), J."""
        if q.dtype.kind in "fc" and self._fast_energies is not None:
            return self._fast_energies(self.placed(q))
        y = self.state(q)
        return stored_energies(with_modes_at(self.system, y), y)

    @cached_property
    def _fast_energies(self) -> "_FastEnergies | None":
        """The energies at floats and complex numbers; None if the modes depend on loads."""
        return None if depend_on_loads(self.system) else _FastEnergies(self.system, self.size)

    def gradient(self, q: Array) -> Array:
        """Return the derivatives of the energy, shape (size,): N m, then N."""
        return jacobian(self.energy, q)


@dataclass(frozen=True, eq=False)
class TouchingConfigurations(Configurations):
    """The configurations of a body that touches a stop: θ2 is given.

    The entry θ2 of q does not count. A spring of 1 N m/rad pulls it to the given angle, so that a
    minimum of the energy is one of all entries of q, and has a regular Hessian.

    Args:
        pitch: θ2, rad.
    """

    pitch: float

    def state(self, q: Array) -> Array:
        """Return the state vector of `system` at rest in the configuration q with the given θ2."""
        return super().state(self.placed(q))

    def placed(self, q: Array) -> Array:
        """Return q with the given θ2."""
        return np.concatenate([q[:PITCH], [self.pitch], q[PITCH + 1 :]])

    def spring(self, q: Array) -> Number:
        """Return the energy of the spring of θ2, J."""
        away = q[PITCH] - self.pitch
        return 0.5 * away * away


class _FastEnergies:
    """The energy stored in each element as a function of q: the equations as `StraightLine`."""

    def __init__(self, system: System, size: int) -> None:
        self._system = system  # as in `Configurations`: its modes do not depend on the loads
        self._energies = StraightLine(_energies_at, system, size)
        self._guards = StraightLine(_guards_at, system, size) if has_modes(system) else None
        self._in_modes: dict[Modes, StraightLine] = {}

    def __call__(self, q: Array) -> Array:
        """Return the energies in the modes that belong to q, shape (elements,), J."""
        if self._guards is None:
            return self._energies(q)
        modes = tuple([float(g.real > 0) for g in self._guards(q).tolist()])
        if modes not in self._in_modes:
            self._in_modes[modes] = self._energies.in_modes_of(with_modes(self._system, modes))
        return self._in_modes[modes](q)


def _energies_at(system: System, q: Array) -> Array:
    return stored_energies(system, Configurations(system).state(q))


def _guards_at(system: System, q: Array) -> Array:
    return guards_at(system, Configurations(system).state(q))


def stored_energies(system: System, y: Array) -> Array:
    """Return the energy stored in each element, shape (elements,), J, without computing any force.

    Args:
        system: The system, in the modes of the state.
        y: The state vector.
    """
    motion = system.motion(y)
    return np.array([element.stored(motion, states) for element, states in system.with_states(y)])


def configurations(system: System) -> Configurations:
    """Return the configurations of a system in any coordinates."""
    held = system.coordinates.holds_contact
    coordinates = ReducedCoordinates() if held else CentreCoordinates()
    return Configurations(System(system.body, system.elements, coordinates, system.anchor))


def as_at_rest(system: System) -> System:
    """Return a system whose stored energy has the force of each element on a body at rest.

    It is the system itself, unless an element does not store the work of this force
    (`Element.at_rest`).
    """
    elements = tuple(element.at_rest() for element in system.elements)
    is_same = all(new is other for new, other in zip(elements, system.elements, strict=True))
    return system if is_same else replace(system, elements=elements)


def without_inputs(system: System) -> System:
    """Return a system without its inputs, and with signals of zero: else it need not be at rest."""
    acting = tuple(element for element in system.elements if not isinstance(element, Input))
    driven = {part.name: Leg(0.0, 0.0, 0.0) for part in acting if isinstance(part, Driven)}
    return with_legs(replace(system, elements=acting), driven)
