"""The configurations of a system: where it can stand still, and what it stores there."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rbstab.mechanics.algebra import ZERO
from rbstab.mechanics.derivatives import jacobian
from rbstab.mechanics.motion import Motion
from rbstab.mechanics.numbers import Array, Number
from rbstab.systems.coordinates import CentreCoordinates, ReducedCoordinates
from rbstab.systems.system import System


@dataclass(frozen=True, eq=False)
class Configurations:
    """All that a system can be without moving: q = [Θ, X, own states], or [Θ, own states] if held.

    At rest the coordinates W and Z say the same, and so do the manifold and its reduced
    coordinates; `system` writes them all in one of two.

    Args:
        system: The system, in coordinates Z, or reduced ones where the contact point is held.
    """

    system: System

    @cached_property
    def held(self) -> bool:
        """Whether the contact point is held fast, so that Θ alone places the body."""
        return self.system.coordinates.holds_contact

    @cached_property
    def placing(self) -> int:
        """The number of entries of q that place the body: the others are the elements' own."""
        return 3 if self.held else 6

    @cached_property
    def size(self) -> int:
        """The number of entries of q."""
        return self.placing + self.system.size - self.system.coordinates.size

    @cached_property
    def unloaded(self) -> Array:
        """Θ = 0, X = X_a, own states 0, shape (size,)."""
        placed = np.concatenate([np.zeros(3), self.system.anchor])[: self.placing]
        return np.concatenate([placed, np.zeros(self.size - self.placing)])

    def state(self, q: Array) -> Array:
        """The state vector of `system` at rest in the configuration q, shape (size,)."""
        positions = [q[0:3], ZERO] if self.held else [q[0:3], ZERO, q[3:6], ZERO]
        return np.concatenate([*positions, q[self.placing :]])

    def motion(self, q: Array) -> Motion:
        """The motion at rest in the configuration q."""
        return self.system.motion(self.state(q))

    def energy(self, q: Array) -> Number:
        """What the elements store, J."""
        return self.system.potential_energy(self.state(q))

    def gradient(self, q: Array) -> Array:
        """The derivatives of the energy, shape (size,): N m, then N."""
        return jacobian(self.energy, q)


def configurations(system: System) -> Configurations:
    """The configurations of a system, whatever its coordinates."""
    held = system.coordinates.holds_contact
    still = ReducedCoordinates() if held else CentreCoordinates()
    return Configurations(System(system.body, system.elements, still, system.anchor))
