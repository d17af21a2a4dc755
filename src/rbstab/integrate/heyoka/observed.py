"""Functions of the states of many members, compiled: quantities by their formulas, and others."""

from collections.abc import Callable, Iterable, Mapping
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
        quantities: The quantities: numbers, or vectors along `axis` or a dimension of own states.
    """

    def __init__(
        self,
        compiled: Callable[[System, Callable[[Observation], list[Any]]], Compiled],
        system: System,
        quantities: Mapping[str, Quantity],
    ) -> None:
        lengths = run_dimensions(system.declared_states)
        self._sizes = {
            name: tuple(lengths[dimension] for dimension in quantity.dimensions[1:])
            for name, quantity in quantities.items()
        }
        self._compiled = compiled(system, lambda seen: values_of(quantities.values(), seen))

    def along(self, parameters: Array, states: Array, times: Array) -> dict[str, Array]:
        """Return the quantities, shape (m, n) or (m, n, size).

        Args:
            parameters: Shape (parameters, m).
            states: With Θ, shape (states, m, n).
            times: Shape (n,), s.
        """
        _, m, n = states.shape
        rows = self._compiled(
            parameters, states.reshape(-1, m * n), np.tile(times, m), np.repeat(np.arange(m), n)
        )
        found, first = {}, 0
        for name, size in self._sizes.items():
            part = rows[first : first + int(np.prod(size))].reshape(*size, m, n)
            found[name] = np.moveaxis(part, 0, 2) if size else part
            first += int(np.prod(size))
        return found
