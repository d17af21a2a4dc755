"""The stored energy at rest of many members at once."""

import numpy as np

from rbstab.analysis.configuration import Configurations, configurations
from rbstab.analysis.rest_state import GRADIENT_TOLERANCE
from rbstab.integrate.heyoka.compiled_scalar import CompiledScalar
from rbstab.mechanics.numbers import Array
from rbstab.systems.system import System

MAX_STEPS = 30

ROUND_OFF = 1e-12
"""Of an energy (or 1 J): how much a step may seem to rise."""


class RestEnergies:
    """The rest states downhill from the unloaded positions, by Newton's method.

    Args:
        system: Any system of the members' structure.
    """

    def __init__(self, system: System) -> None:
        self.still = configurations(system)
        self.energy = CompiledScalar(
            self.still.system, lambda s, q: Configurations(s).energy(q), self.still.size
        )

    def of(self, parameters: Array) -> tuple[Array, Array]:
        """The energies, shape (m,), J, and which of them are found, shape (m,).

        A member counts as found where every step went downhill between convex places: then this is
        where the descent of `nearest_rest_state` ends. The others have to be looked for there.

        Args:
            parameters: Shape (parameters, m), in the order of `parameter_values`.
        """
        q = self._unloaded(parameters)
        sound = np.ones(q.shape[1], dtype=bool)
        with np.errstate(all="ignore"):
            here = self.energy.at(parameters, q)
            for _ in range(MAX_STEPS):
                sound &= _convex(here.hessian)
                moving = sound & (np.abs(here.gradient).max(axis=1) > GRADIENT_TOLERANCE)
                if not moving.any():
                    break
                slope = here.gradient[moving][..., np.newaxis]
                q[:, moving] -= np.linalg.solve(here.hessian[moving], slope)[..., 0].T
                there = self.energy.at(parameters, q)
                slack = ROUND_OFF * (np.abs(here.value) + 1.0)
                sound &= ~moving | (there.value <= here.value + slack)
                here = there
            arrived = np.abs(here.gradient).max(axis=1) <= GRADIENT_TOLERANCE
        return here.value, sound & arrived & (np.abs(q[1]) < np.pi / 2)

    def _unloaded(self, parameters: Array) -> Array:
        """`Configurations.unloaded` of each member, shape (n, m)."""
        q = np.zeros((self.still.size, parameters.shape[1]))
        if not self.still.held:
            anchor = self.energy.offsets["anchor"]
            q[3:6] = parameters[anchor : anchor + 3]
        return q


def _convex(hessians: Array) -> Array:
    """Whether each of some symmetric matrices is positive definite, shape (m,)."""
    broken = ~np.isfinite(hessians).all(axis=(1, 2), keepdims=True)
    given = np.where(broken, -np.eye(hessians.shape[1]), hessians)
    smallest: Array = np.linalg.eigvalsh(given)[:, 0]
    return smallest > 0
