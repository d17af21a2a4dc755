"""Systems as heyoka's expressions: their equations with symbols for states and parameters."""

from collections.abc import Callable
from typing import Any

import heyoka as hy
import numpy as np

from rbstab.integrate.problem import Problem
from rbstab.mechanics.numbers import Array, cos_of, sin_of
from rbstab.systems.parameters import map_parameters, parameters
from rbstab.systems.system import AUDIT_SIZE, System

sin_of.register(hy.expression, hy.sin)
cos_of.register(hy.expression, hy.cos)

# What heyoka would log (a step that is not a number) is a status here.
hy.set_logger_level_critical()


def open_symbol(index: int) -> Any:
    """The symbol of one open parameter."""
    return hy.par[index]


def symbols_of(
    system: System, symbol_of: Callable[[int], Any] = open_symbol
) -> tuple[System, dict[str, int], int]:
    """A system whose parameters are symbols, by default `par[]`.

    Args:
        system: Any system of the structure.
        symbol_of: What stands for the parameter of that index.

    Returns:
        The symbolic system, the index of each parameter's first symbol, and the number of symbols.
    """
    offsets: dict[str, int] = {}
    count = 0

    def symbol(name: str, value: Array) -> Array:
        nonlocal count
        offsets[name] = count
        symbols = [symbol_of(count + k) for k in range(value.size)]
        count += value.size
        return np.array(symbols, dtype=object).reshape(value.shape)

    return map_parameters(system, symbol), offsets, count


def state_symbols(size: int) -> Array:
    """The symbols of a state vector."""
    return np.array([hy.expression(f"y{k}") for k in range(size)], dtype=object)


def parameter_values(system: System) -> Array:
    """The values that belong to the symbols of `symbols_of`, in their order."""
    return np.concatenate([np.ravel(value) for value in parameters(system).values()])


def scaled_audit(rates: Array, scale: Any) -> Array:
    """Audited rates with those of the audit states in units of an energy.

    heyoka measures its error against the largest of all states. Audit states are energies, as large
    as the body is heavy: unscaled they would drown the error of the motion.
    """
    return np.concatenate([rates[:-AUDIT_SIZE], rates[-AUDIT_SIZE:] / scale])


def energy_scale(problem: Problem) -> float:
    """The size of the energies at the start, J; 1 J where there are none, or more than numbers."""
    with np.errstate(all="ignore"):
        size = float(np.abs(problem.system.observe(problem.start).energy).sum())
    return size if 0.0 < size < np.inf else 1.0
