"""Formulas of three angles, and of a position, recorded as those of an element of a user are."""

from collections.abc import Callable
from typing import Any

import mpmath
import numpy as np

from rbstab.analysis.proof.formulas.program import LENGTH, THETA, Program, program_of
from rbstab.integrate.straight_line.number import Trace
from rbstab.mechanics import numbers

Formula = Callable[[Any], Any]

for _name, _of in numbers.FUNCTIONS.items():
    _of.register(mpmath.mpf, getattr(mpmath, _name))


def recorded(formula: Formula) -> Program:
    """Return the operations of a formula of Θ."""
    trace = Trace()
    Theta = np.array([trace.input(varies=True) for _ in range(3)], dtype=object)
    inputs = {number.index: (THETA, axis) for axis, number in enumerate(Theta)}
    return program_of(trace, trace.index_of(formula(Theta)), inputs)


def recorded_of_position(formula: Callable[[Any, Any], Any]) -> Program:
    """Return the operations of a formula of Θ and X."""
    return recorded_of_own_states(formula, 3)


def recorded_of_own_states(formula: Callable[[Any, Any], Any], count: int) -> Program:
    """Return the operations of a formula of Θ and some own states."""
    trace = Trace()
    numbers_ = np.array([trace.input(varies=True) for _ in range(3 + count)], dtype=object)
    Theta, D = numbers_[:3], numbers_[3:]
    inputs = {number.index: (THETA, axis) for axis, number in enumerate(Theta)}
    inputs |= {number.index: (LENGTH, place) for place, number in enumerate(D)}
    return program_of(trace, trace.index_of(formula(Theta, D)), inputs)


def _all_functions(Theta: Any) -> Any:
    a, b, c = Theta
    x = numbers.sin_of(a) * numbers.cos_of(c) + 0.3 * b
    inner = 1.5 + x * x + numbers.tanh_of(b) * numbers.atan_of(c)
    outer = numbers.sqrt_of(inner) - numbers.log_of(inner + 2) / (3 + x**2)
    return outer * numbers.exp_of(-x) + numbers.tan_of(0.2 * b) * numbers.sinh_of(a - c) - x**3


FORMULAS: dict[str, Formula] = {
    "all functions": _all_functions,
    "a well": lambda T: -2.0 * numbers.exp_of(-3.0 * ((T[0] - 0.5) ** 2 + (T[1] + T[2]) ** 2)),
    "quotients": lambda T: (1 + numbers.cos_of(T[0])) / (2.5 - numbers.sin_of(T[1]) * T[2] ** -2),
    "an angle": lambda T: T[1],
    "powers": lambda T: (T[0] + 2) ** -3 + T[1] ** 4 * T[2] ** 5 - numbers.cosh_of(T[1]),
}
