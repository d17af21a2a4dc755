"""Fast evaluation of the equations of a system, by code that is made from these equations.

numpy takes about a microsecond for each operation on three numbers. So a function of a system and a
vector is called once with numbers that record its operations, and then evaluated by Python code of
floats. The code is made once for each structure. Parameters are inputs of the code, but zeros (of
diagonal gains) are constants: a third of the operations remains. The modes of elements that switch
(`systems.modes`) and the legs of signals (`systems.schedule`) are inputs of it too, even if zero.
"""

import cmath
import math
from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from rbstab.integrate.straight_line.code import Evaluate, Prepare, compiled
from rbstab.integrate.straight_line.number import Trace
from rbstab.mechanics.numbers import Array
from rbstab.systems.modes import mode_parameters
from rbstab.systems.parameters import map_parameters, parameters, structure
from rbstab.systems.schedule import leg_parameters
from rbstab.systems.system import System

Equations = Callable[[System, Array], Array]
"""A function of a system and a vector, for any kind of number; its result has shape (n,)."""

MAX_CODES = 128
"""The most codes in the cache. A sliding connector has 27 modes, each with its own zeros."""


class StraightLine:
    """The equations of one system as a function of a vector.

    numpy evaluates them instead if they cannot be traced, or if the vector or their value is not
    finite. So the errors and the non-finite numbers are those of numpy.

    Args:
        equations: The equations.
        system: The system.
        size: The length of the vector.
    """

    def __init__(self, equations: Equations, system: System, size: int) -> None:
        self._equations, self._system = equations, system
        self._by_kind = _prepared(equations, system, size)

    def __call__(self, x: Array) -> Array:
        """Return the value, shape (n,), at a vector of floats or complex numbers."""
        value = self.finite_value(x)
        return self.by_numpy(x) if value is None else value

    def by_numpy(self, x: Array) -> Array:
        """Return the value as numpy evaluates it, at a vector of any kind of number."""
        return self._equations(self._system, x)

    def finite_value(self, x: Array) -> Array | None:
        """Return the value, shape (n,); None if it or x is not finite, or if there is no code."""
        evaluate = self._by_kind.get(x.dtype.char)
        if evaluate is None:
            return None
        entries = x.tolist()
        try:
            value = evaluate(entries)
            # One number that is not finite makes the sum so. So can an overflow of the sum itself.
            # Entries count too: numpy's 0·x is NaN if x is infinite, and the code leaves it out.
            return np.array(value) if cmath.isfinite(sum(value) + sum(entries)) else None
        except (ArithmeticError, ValueError):
            # Python raises for 1/0 and sin(inf), where numpy returns NaN.
            return None


@dataclass(frozen=True)
class _Recipe:
    """All that a code depends on: equations, structure, size and zeros; and a system to trace."""

    equations: Equations
    structure: Hashable
    size: int
    is_zero: tuple[bool, ...]
    system: System = field(compare=False)


def _prepared(equations: Equations, system: System, size: int) -> dict[str, Evaluate]:
    """Return the code for each kind of number of a vector, by numpy's character of its type."""
    try:
        named = parameters(system)
        flat = [np.ravel(value) for value in named.values()]
        kind = structure(system)
    except ValueError:
        # Two elements have the same name, and so their parameters have.
        return {}
    if any(value.dtype.kind not in "if" for value in flat):
        return {}
    values = np.concatenate(flat).astype(float)
    # One code serves all modes and all legs, so one of zero is an input as well.
    changing = mode_parameters(system) | leg_parameters(system)
    changes = [np.full(value.size, name in changing) for name, value in named.items()]
    is_zero = (values == 0.0) & ~np.concatenate(changes)
    recipe = _Recipe(equations, kind, size, tuple(is_zero.tolist()), system)
    prepare = _code(recipe)
    if prepare is None:
        return {}
    inputs = values[~is_zero].tolist()
    try:
        real = prepare(inputs, math)
        return {"d": real, "D": prepare(inputs, cmath)}
    except (ArithmeticError, ValueError):
        return {}


@lru_cache(MAX_CODES)
def _code(recipe: _Recipe) -> Prepare | None:
    """Return the code of equations, or None if they cannot be traced."""
    trace, zeros = Trace(), iter(recipe.is_zero)

    def symbols(_: str, value: Array) -> Array:
        entries = [0.0 if next(zeros) else trace.input(varies=False) for _ in range(value.size)]
        return np.array(entries, dtype=object).reshape(value.shape)

    try:
        symbolic = map_parameters(recipe.system, symbols)
        x = np.array([trace.input(varies=True) for _ in range(recipe.size)], dtype=object)
        results = [trace.index_of(entry) for entry in recipe.equations(symbolic, x).tolist()]
    except Exception:
        # An element may use a function or a branch that no trace can record. If the reason is
        # another one, numpy raises the same error.
        return None
    return compiled(trace, results)


def forget_codes() -> None:
    """Empty the cache of codes, to measure or test how they are made."""
    _code.cache_clear()
