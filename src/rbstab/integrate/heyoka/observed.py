"""Functions of the states of many members, compiled: quantities by their formulas, and others."""

from collections.abc import Callable, Iterable, Mapping
from functools import partial
from typing import Any

import numpy as np

from rbstab.integrate.heyoka.compiled_map import Compiled
from rbstab.mechanics.numbers import Array
from rbstab.systems.quantities import Quantity, run_dimensions, values_of
from rbstab.systems.system import Observation, System


class OfMembers(Compiled):
    """A compiled function of the state, the parameters that differ between members, and the time.

    Args:
        entries: Its values: expressions, or numbers.
        symbols: The symbols of the state, shape (states,).
        open_indices: The indices of the parameters that differ between members.
    """

    def __init__(self, entries: Iterable[Any], symbols: Array, open_indices: Array) -> None:
        super().__init__(entries, symbols)
        self._open = open_indices[: self.parameters]

    def at(self, parameters: Array, y: Array, times: Array, members: Array) -> Array:
        """Return the values at states, shape (values, p).

        Args:
            parameters: The parameters of all members, shape (parameters, m).
            y: The states; more rows may follow, shape (states, p).
            times: Their times, shape (p,), s.
            members: The member of each, shape (p,).
        """
        return self(y, np.take(parameters[self._open], members, axis=1), times)


class Observed:
    """Quantities of members by name, compiled from their formulas.

    Args:
        compiled: Compiles the numbers of an `Observation` of a system (`Ensemble.compiled`).
        system: The system of symbols.
        groups: The quantities: numbers, or vectors along `axis` or a dimension of own states. Each
            group is compiled by itself: the last bits of a sum depend on what is compiled with it.
    """

    def __init__(
        self,
        compiled: Callable[[System, Callable[[Observation], list[Any]]], OfMembers],
        system: System,
        *groups: Mapping[str, Quantity],
    ) -> None:
        self._groups = [
            (compiled(system, partial(values_of, group.values())), group) for group in groups
        ]
        self._lengths = run_dimensions(system.declared_states)

    def along(self, parameters: Array, states: Array, times: Array) -> dict[str, Array]:
        """Return the quantities, shape (m, n) or (m, n, size).

        Args:
            parameters: Shape (parameters, m).
            states: With Θ, shape (states, m, n).
            times: Shape (n,), s.
        """
        _, m, n = states.shape
        flat = states.reshape(-1, m * n), np.tile(times, m), np.repeat(np.arange(m), n)
        values = {}
        for compiled, group in self._groups:
            rows = iter(compiled.at(parameters, *flat).reshape(-1, m, n))
            for name, quantity in group.items():
                sizes = [self._lengths[dimension] for dimension in quantity.dimensions[1:]]
                if sizes:
                    # Each component stays contiguous along the samples.
                    part = np.array([next(rows) for _ in range(sizes[0])])
                    values[name] = np.moveaxis(part, 0, 2)
                else:
                    values[name] = next(rows)
        return values
