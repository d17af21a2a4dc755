"""Fast evaluation of the equations of a system, by code that is made from these equations.

numpy takes about a microsecond for each operation on three numbers. So a function of a system and a
vector is called once with numbers that record its operations, and then evaluated by Python code of
floats. The code is made once for each structure. Parameters are inputs of the code, but zeros (of
diagonal gains) are constants: a third of the operations remains. The modes of elements that switch
(`systems.modes`) and the legs of signals (`systems.schedule`) are inputs of it too, even if zero.
"""

import cmath
import copy
import math
from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from rbstab.integrate.straight_line.code import Evaluate, Prepare, compiled
from rbstab.integrate.straight_line.number import Trace
from rbstab.mechanics.numbers import Array
from rbstab.systems.filippov import idle_holds
from rbstab.systems.modes import Modes, mode_parameters, modes_of
from rbstab.systems.parameters import map_parameters, parameters, structure
from rbstab.systems.schedule import leg_parameters
from rbstab.systems.system import System

Equations = Callable[..., Array]
"""A function of a system, a vector and perhaps the time, for any kind of number. Its result has
shape (n,)."""

MAX_CODES = 256
"""The most codes in the cache, of some 100 kB each. A sliding connector has 27 modes, each with its
own zeros, and codes of rates, event functions, energies and samples."""


class StraightLine:
    """The equations of one system as a function of a vector, and of the time if they are `timed`.

    numpy evaluates them instead if they cannot be traced, or if the vector or their value is not
    finite. So the errors and the non-finite numbers are those of numpy.

    Args:
        equations: The equations.
        system: The system.
        size: The length of the vector; default that of the audited state.
        timed: Whether they get the time as well. Without it the code has one number less.
    """

    def __init__(
        self, equations: Equations, system: System, size: int | None = None, *, timed: bool = False
    ) -> None:
        self._equations, self._system, self._timed = equations, system, timed
        self._size = system.audited_size if size is None else size

    @cached_property
    def _code(self) -> "_Code | None":
        """The code, made when a value is first asked for: heyoka's runs often ask for none."""
        return _prepared(self._equations, self._system, self._size, self._timed)

    @cached_property
    def _by_kind(self) -> dict[str, Evaluate]:
        """The code for each kind of number."""
        return {} if self._code is None else self._code.evaluations()

    def in_modes_of(self, system: System) -> "StraightLine":
        """Return the same equations of a system that differs from this one in its modes alone."""
        if idle_holds(system) != idle_holds(self._system):
            return StraightLine(self._equations, system, self._size, timed=self._timed)
        code = self._code
        other = copy.copy(self)
        other._system = system
        if code is not None:
            other._by_kind = code.evaluations(modes_of(system))
        return other

    def __call__(self, x: Array, t: complex = 0.0) -> Array:
        """Return the value, shape (n,), at a vector of floats or complex numbers, and a time, s."""
        value = self.finite_value(x, t)
        return self.by_numpy(x, t) if value is None else value

    def by_numpy(self, x: Array, t: complex = 0.0) -> Array:
        """Return the value as numpy evaluates it, at a vector of any kind of number."""
        return self._equations(self._system, x, *([t] if self._timed else []))

    def finite_value(self, x: Array, t: complex = 0.0) -> Array | None:
        """Return the value, shape (n,); None if it or x is not finite, or if there is no code."""
        value = self.finite_entries(x, t)
        return None if value is None else np.array(value)

    def finite_entries(self, x: Array, t: complex = 0.0) -> list[Any] | None:
        """Return `finite_value` as Python numbers: a few of them are handled faster than arrays."""
        evaluate = self._by_kind.get(x.dtype.char)
        if evaluate is None:
            return None
        entries = x.tolist()
        if self._timed:
            entries.append(t)
        try:
            value = evaluate(entries)
            # One number that is not finite makes the sum so. So can an overflow of the sum itself.
            # Entries count too: numpy's 0·x is NaN if x is infinite, and the code leaves it out.
            return value if cmath.isfinite(sum(value) + sum(entries)) else None
        except (ArithmeticError, ValueError):
            # Python raises for 1/0 and sin(inf), where numpy returns NaN.
            return None


@dataclass(frozen=True)
class _Recipe:
    """All that a code depends on: equations, structure, sizes and zeros; and a system to trace."""

    equations: Equations
    structure: Hashable
    size: int
    timed: bool
    is_zero: tuple[bool, ...]
    system: System = field(compare=False)


@dataclass(frozen=True)
class _Code:
    """The code of equations with its inputs, and the place of each mode among them."""

    prepare: Prepare
    inputs: list[float]
    mode_places: list[tuple[int, int]]

    def evaluations(self, modes: Modes = ()) -> dict[str, Evaluate]:
        """Return the code for each kind of number of a vector, by numpy's character of its type."""
        inputs = self.inputs.copy()
        # The modes are in the order of the elements; () means those of the inputs.
        for mode, place in self.mode_places if modes else []:
            inputs[place] = modes[mode]
        try:
            return {"d": self.prepare(inputs, math), "D": self.prepare(inputs, cmath)}
        except (ArithmeticError, ValueError):
            return {}


def _prepared(equations: Equations, system: System, size: int, timed: bool) -> _Code | None:
    """Return the code of equations with the parameters of a system; None if there is none."""
    try:
        named = parameters(system)
        flat = [np.ravel(value) for value in named.values()]
        kind = structure(system)
    except ValueError:
        # Two elements have the same name, and so their parameters have.
        return None
    if any(value.dtype.kind not in "if" for value in flat):
        return None
    values = np.concatenate(flat).astype(float)
    # One code serves all modes and all legs, so one of zero is an input as well. But most phases
    # hold no axis, and the forces that would hold it are a large part of the code.
    mode_names, legs = mode_parameters(system), leg_parameters(system)
    sizes = [value.size for value in flat]
    is_mode, is_leg = (
        np.repeat([name in of for name in named], sizes) for of in (mode_names, legs)
    )
    idle = np.flatnonzero(is_mode)[list(idle_holds(system))]
    is_input = (values != 0.0) | is_mode | is_leg
    is_input[idle] = False
    recipe = _Recipe(equations, kind, size, timed, tuple((~is_input).tolist()), system)
    prepare = _code(recipe)
    if prepare is None:
        return None
    places = np.cumsum(is_input)[is_mode] - 1
    moving = np.flatnonzero(is_input[is_mode]).tolist()
    modes_and_places = [(mode, int(places[mode])) for mode in moving]
    return _Code(prepare, values[is_input].tolist(), modes_and_places)


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
        time = [trace.input(varies=True)] if recipe.timed else []
        values = recipe.equations(symbolic, x, *time)
        results = [trace.index_of(entry) for entry in values.tolist()]
    except Exception:
        # An element may use a function or a branch that no trace can record. If the reason is
        # another one, numpy raises the same error.
        return None
    return compiled(trace, results)


def audited_rates_of(system: System) -> StraightLine:
    """Return the audited rates of a system, as a function of the audited state and the time."""
    return StraightLine(System.audited_rates, system, timed=system.timed)


def forget_codes() -> None:
    """Empty the cache of codes, to measure or test how they are made."""
    _code.cache_clear()
