"""Systems as heyoka expressions, with symbols for states and parameters."""

from collections.abc import Callable
from typing import Any

import heyoka as hy
import numpy as np

from rbstab.integrate.problem import Problem
from rbstab.mechanics.numbers import FUNCTIONS, Array
from rbstab.systems.parameters import map_parameters, parameters
from rbstab.systems.system import AUDIT_SIZE, System

for _name, _of in FUNCTIONS.items():
    _of.register(hy.expression, getattr(hy, _name))

# Do not log failures such as a step that is NaN: they become statuses.
hy.set_logger_level_critical()


def open_symbol(index: int) -> Any:
    """Return `par[index]`, a parameter whose value is set at run time."""
    return hy.par[index]


def symbols_of(
    system: System, symbol_of: Callable[[int], Any] = open_symbol
) -> tuple[System, dict[str, int], int]:
    """Return a system whose parameters are symbols, by default `par[]`.

    Args:
        system: Any system of the structure.
        symbol_of: Returns the symbol of a parameter, given its index.

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
    """Return the symbols of a state vector."""
    return np.array([hy.expression(f"y{k}") for k in range(size)], dtype=object)


def parameter_values(system: System) -> Array:
    """Return the parameter values of a system, in the order of the symbols of `symbols_of`."""
    return np.concatenate([np.ravel(value) for value in parameters(system).values()])


def scaled_audit(rates: Array, scale: Any) -> Array:
    """Return audited rates in which the rates of the audit states are divided by an energy scale.

    heyoka measures its error relative to the largest state. Audit states are energies and grow with
    the mass of the body. Unscaled, they would hide the error of the motion.
    """
    return np.concatenate([rates[:-AUDIT_SIZE], rates[-AUDIT_SIZE:] / scale])


def energy_scale(problem: Problem) -> float:
    """Return the sum of the absolute energies at the start, J; 1 J if it is zero or not finite."""
    with np.errstate(all="ignore"):
        size = float(np.abs(problem.system.observe(problem.start).energy).sum())
    return size if 0.0 < size < np.inf else 1.0
