"""Functions of the states of many members, compiled: quantities by their formulas, and others."""

from collections.abc import Callable, Iterable, Mapping
from functools import partial
from typing import Any

import heyoka as hy
import numpy as np

from rbstab.integrate.heyoka.compiled_map import SIMD, lanes_of
from rbstab.mechanics.numbers import Array
from rbstab.systems.quantities import Quantity, run_dimensions, values_of
from rbstab.systems.system import Observation, System


class Compiled:
    """A compiled function of the state, the parameters that differ between members, and the time.

    Args:
        entries: Its values: expressions, or numbers.
        symbols: The symbols of the state, shape (states,).
        open_indices: The indices of the parameters that differ between members.
    """

    def __init__(self, entries: Iterable[Any], symbols: Array, open_indices: Array) -> None:
        expressions = [hy.expression(0.0) + entry for entry in entries]
        self._compiled = hy.cfunc(expressions, vars=list(symbols))
        self._open = open_indices[: self._compiled.nparams]
        self._size = len(symbols)

    def __call__(self, parameters: Array, y: Array, times: Array, members: Array) -> Array:
        """Return the values at states, shape (values, p). No bit depends on the other states.

        Args:
            parameters: The parameters of all members, shape (parameters, m).
            y: The states; more rows may follow, shape (states, p).
            times: Their times, shape (p,), s.
            members: The member of each, shape (p,).
        """
        count = len(members)
        if count % SIMD:
            # heyoka evaluates an incomplete SIMD vector with other code.
            full = lanes_of(count)
            return self(parameters, y[:, full], times[full], members[full])[:, :count]
        time = {"time": np.ascontiguousarray(times)} if self._compiled.is_time_dependent else {}
        pars = np.take(parameters[self._open], members, axis=1)
        return np.asarray(self._compiled(np.ascontiguousarray(y[: self._size]), pars=pars, **time))


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
        compiled: Callable[[System, Callable[[Observation], list[Any]]], Compiled],
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
        found = {}
        for compiled, group in self._groups:
            rows = iter(compiled(parameters, *flat).reshape(-1, m, n))
            for name, quantity in group.items():
                sizes = [self._lengths[one] for one in quantity.dimensions[1:]]
                if sizes:
                    # Each component stays contiguous along the samples.
                    part = np.array([next(rows) for _ in range(sizes[0])])
                    found[name] = np.moveaxis(part, 0, 2)
                else:
                    found[name] = next(rows)
        return found
