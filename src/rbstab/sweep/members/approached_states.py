"""Find the rest states that many members approach, all at once."""

from typing import NamedTuple

import numpy as np

from rbstab.analysis.approached_state import SAME_STATE, falls, is_lower
from rbstab.analysis.configuration import (
    ORIENTATION,
    POSITION,
    Configurations,
    as_at_rest,
    configurations,
)
from rbstab.analysis.descents.descent import descend
from rbstab.analysis.rest_state import gradient_tolerance
from rbstab.integrate.heyoka.compiled_map import CompiledScalar, ScalarAt
from rbstab.integrate.heyoka.symbols import symbols_of
from rbstab.mechanics.attitude import is_upright
from rbstab.mechanics.numbers import Array
from rbstab.systems.system import System

NEAR = 0.05
"""rad and m: if a member ends this close to the shared rest state, it is taken to approach it,
without a descent. Single runs always descend; the comparison with them checks this."""


class RestStatesOfMembers(NamedTuple):
    """Rest states of m members. Where `approached` is false, the others are not those of one.

    Attributes:
        energy: The stored energy, shape (m,), J.
        orientation: Θ, shape (m, 3), rad.
        approached: Whether the member is found to approach it, shape (m,).
        unstable: Whether it is unstable, shape (m,).
    """

    energy: Array
    orientation: Array
    approached: Array
    unstable: Array


class SharedState(NamedTuple):
    """The rest state nearest to the unloaded position, if it is the same for all members.

    Attributes:
        q: The configuration, shape (n,); None if it is the unloaded position of each member.
        energy: The stored energy, J. It rises in all directions.
    """

    q: Array | None
    energy: float


class ApproachedStates:
    """Finds the rest states in which descents in energy from the last samples end.

    Args:
        system: A system with the structure of the members.
        shared: The rest state nearest to the unloaded position of all members; None if they differ.
    """

    def __init__(self, system: System, shared: SharedState | None) -> None:
        self.configurations = configurations(as_at_rest(system))
        self.shared = shared
        _, self._offsets, _ = symbols_of(self.configurations.system)
        self._compiled: CompiledScalar | None = None

    def find(self, parameters: Array, last: Array) -> RestStatesOfMembers:
        """Return the rest states that members approach.

        Args:
            parameters: Shape (parameters, m), in the order of `parameter_values`.
            last: The configurations at the last samples, shape (n, m).
        """
        count = last.shape[1]
        q, energy, approached = last.copy(), np.full(count, np.nan), np.zeros(count, dtype=bool)
        if self.shared is not None:
            shared = self._shared_configurations(parameters)
            approached = np.abs(last - shared).max(axis=0) < NEAR
            q[:, approached], energy[approached] = shared[:, approached], self.shared.energy
        unstable = np.zeros(count, dtype=bool)
        rows = np.flatnonzero(~approached & np.isfinite(last).all(axis=0))
        if len(rows):
            q[:, rows], energy[rows], approached[rows] = self._descended(
                parameters[:, rows], last[:, rows]
            )
            unstable[rows] = falls(self._energy().at(parameters[:, rows], q[:, rows]).hessian)
            if self.shared is not None:
                lower = is_lower(energy, self.shared.energy) | is_lower(self.shared.energy, energy)
                same = (np.abs(q - shared).max(axis=0) < SAME_STATE) & ~lower
                q[:, same], energy[same] = shared[:, same], self.shared.energy
        return RestStatesOfMembers(energy, q[ORIENTATION].T, approached, unstable & approached)

    def _descended(self, parameters: Array, starts: Array) -> tuple[Array, Array, Array]:
        def energy(rows: Array, q: Array) -> ScalarAt:
            return self._energy().at(parameters[:, rows], q)

        tolerance = self._tolerances(parameters, starts)
        q, value, converged = descend(
            energy, starts, tolerance, is_inside=lambda q: is_upright(q[ORIENTATION])
        )
        return q, value, converged & is_upright(q[ORIENTATION])

    def _energy(self) -> CompiledScalar:
        """Return the compiled energy. It is compiled only if a member needs it."""
        if self._compiled is None:
            self._compiled = CompiledScalar(
                self.configurations.system,
                lambda s, q: Configurations(s).energy(q),
                self.configurations.size,
            )
        return self._compiled

    def _tolerances(self, parameters: Array, q: Array) -> Array:
        """Return the gradient at which the descent of each member ends, shape (m,), N m and N."""
        offset = self._offsets["gravity.weight"]
        weight = np.abs(parameters[offset : offset + 3]).max(axis=0)
        load = np.maximum(weight, np.abs(self._energy().at(parameters, q).gradient).max(axis=1))
        return np.array([gradient_tolerance(member_load) for member_load in load.tolist()])

    def _shared_configurations(self, parameters: Array) -> Array:
        """Return the configuration of the shared state for each member, shape (n, m)."""
        assert self.shared is not None
        q = np.zeros((self.configurations.size, parameters.shape[1]))
        if self.shared.q is not None:
            q[:] = self.shared.q[:, np.newaxis]
        elif not self.configurations.held:
            anchor = self._offsets["anchor"]
            q[POSITION] = parameters[anchor : anchor + 3]
        return q
