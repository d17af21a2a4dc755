"""Compute the stored energy at rest of many members at once."""

import numpy as np

from rbstab.analysis.configuration import POSITION, Configurations, configurations
from rbstab.analysis.rest_state import GRADIENT_TOLERANCE
from rbstab.integrate.heyoka.compiled_scalar import CompiledScalar
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import PITCH
from rbstab.systems.system import System

MAX_STEPS = 30

ROUND_OFF = 1e-12
"""Allowed rise of the energy in a step, relative to the energy plus 1 J."""


class RestEnergies:
    """Finds rest states by Newton's method, downwards in energy from the unloaded positions.

    Args:
        system: A system with the structure of the members.
    """

    def __init__(self, system: System) -> None:
        self.configurations = configurations(system)
        self.energy = CompiledScalar(
            self.configurations.system,
            lambda s, q: Configurations(s).energy(q),
            self.configurations.size,
        )

    def energies(self, parameters: Array) -> tuple[Array, Array]:
        """Return the energies at rest, and which of them were found.

        A rest state counts as found if the energy is convex at each iterate and no step raises it.
        Then the descent of `nearest_rest_state` ends at the same state. For other members, the
        caller has to use `nearest_rest_state`.

        Args:
            parameters: Shape (parameters, m), in the order of `parameter_values`.

        Returns:
            The energies, shape (m,), J, and booleans that are true where found, shape (m,).
        """
        q = self._unloaded(parameters)
        valid = np.ones(q.shape[1], dtype=bool)
        with np.errstate(all="ignore"):
            current = self.energy.at(parameters, q)
            tolerance = self._tolerances(parameters, current.gradient)
            for _ in range(MAX_STEPS):
                valid &= _convex(current.hessian)
                moving = valid & (np.abs(current.gradient).max(axis=1) > tolerance)
                if not moving.any():
                    break
                slope = current.gradient[moving][..., np.newaxis]
                q[:, moving] -= np.linalg.solve(current.hessian[moving], slope)[..., 0].T
                following = self.energy.at(parameters, q)
                slack = ROUND_OFF * (np.abs(current.value) + 1.0)
                valid &= ~moving | (following.value <= current.value + slack)
                current = following
            converged = np.abs(current.gradient).max(axis=1) <= tolerance
        return current.value, valid & converged & (np.abs(q[PITCH]) < np.pi / 2)

    def _tolerances(self, parameters: Array, gradient: Array) -> Array:
        """Return the gradient at which the descent of each member ends, shape (m,), N m and N."""
        offset = self.energy.offsets["gravity.weight"]
        weight = np.abs(parameters[offset : offset + 3]).max(axis=0)
        load = np.maximum(weight, np.abs(gradient).max(axis=1))
        return np.minimum(GRADIENT_TOLERANCE, GRADIENT_TOLERANCE * load)

    def _unloaded(self, parameters: Array) -> Array:
        """Return `Configurations.unloaded` of each member, shape (n, m)."""
        q = np.zeros((self.configurations.size, parameters.shape[1]))
        if not self.configurations.held:
            anchor = self.energy.offsets["anchor"]
            q[POSITION] = parameters[anchor : anchor + 3]
        return q


def _convex(hessians: Array) -> Array:
    """Return whether each symmetric matrix, shape (m, n, n), is positive definite; shape (m,)."""
    invalid = ~np.isfinite(hessians).all(axis=(1, 2), keepdims=True)
    checked = np.where(invalid, -np.eye(hessians.shape[1]), hessians)
    smallest: Array = np.linalg.eigvalsh(checked)[:, 0]
    return smallest > 0
