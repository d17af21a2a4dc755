"""Formulas and their rates modulo a prime p, at points that are chosen once, as if at random.

A function of one number has a value that is chosen for its argument, so that the relations and the
derivatives that hold for these functions hold for these values: sin² + cos² = 1, exp(-x) exp(x) = 1
and so on. What is equal for all real numbers by such relations is equal here. What is not differs,
but for an accident with a probability far below 1e-30.

A square root has no sign here: that of each argument is chosen for each point. So what holds for
one sign alone, as √(x²) = x, or by a relation of two roots, as √(9x) = 3√x, differs at half of all
points. If the root of a constant does not exist, any number takes its place.
"""

import hashlib
from collections.abc import Callable, Collection, Mapping, Sequence
from fractions import Fraction
from typing import NamedTuple

from rbstab.analysis.proof.formulas.program import Operation, indices_of
from rbstab.analysis.proof.formulas.terms import meant
from rbstab.integrate.straight_line.number import (
    ADD,
    CONSTANT,
    DIVIDE,
    MULTIPLY,
    NEGATE,
    POWER,
    SUBTRACT,
)

P = 314159265358979323846264338327950288419717627
"""The prime p, 3 mod 4: the first digits of π, so that no formula has to do with it. With 2¹²⁷ - 1,
for example, a factor of 2¹²⁷ would not be seen."""


class Dual(NamedTuple):
    """A number modulo p, and its rate in time."""

    value: int
    rate: int


class NoValueError(Exception):
    """A formula has no value at a point."""


def values(
    operations: Sequence[Operation],
    needed: Collection[int],
    rates: Mapping[Operation, int],
    point: int,
) -> list[Dual]:
    """Return the results of operations at a point.

    Args:
        operations: The operations.
        needed: The indices of those that are computed, with all that they need. Any other one could
            have no value at some points, and so choose among them.
        rates: The rates of variables; that of any other one is 0.
        point: The number of the point.

    Raises:
        NoValueError: One has no value there.
    """
    found: list[Dual] = []
    fixed: list[bool] = []
    for place, operation in enumerate(operations):
        kind, *operands = operation
        indices = indices_of(operation)
        fixed.append(kind == CONSTANT or (bool(indices) and all(fixed[k] for k in indices)))
        numbers = [found[index] for index in indices]
        if place not in needed:
            found.append(Dual(0, 0))
        elif kind == CONSTANT:
            found.append(Dual(_residue(meant(operands[0])), 0))
        elif not numbers:
            found.append(Dual(_some(point, kind, operands[0]), rates.get(operation, 0)))
        elif kind == "sqrt":
            root = _root(point, numbers[0].value, fixed=fixed[-1])
            found.append(_through((root, _inverse(2 * root)), numbers[0]))
        elif kind in _OPERATIONS:
            found.append(_OPERATIONS[kind](*numbers, *operands[len(numbers) :]))
        else:
            found.append(_through(_FUNCTIONS[kind](point, numbers[0].value), numbers[0]))
    return found


def _add(x: Dual, y: Dual) -> Dual:
    return Dual((x.value + y.value) % P, (x.rate + y.rate) % P)


def _negate(x: Dual) -> Dual:
    return Dual(-x.value % P, -x.rate % P)


def _subtract(x: Dual, y: Dual) -> Dual:
    return _add(x, _negate(y))


def _multiply(x: Dual, y: Dual) -> Dual:
    return Dual(x.value * y.value % P, (x.rate * y.value + x.value * y.rate) % P)


def _divide(x: Dual, y: Dual) -> Dual:
    return _multiply(x, _raise(y, -1))


def _raise(x: Dual, exponent: int) -> Dual:
    slope = exponent * _power(x.value, exponent - 1) if exponent else 0
    return _through((_power(x.value, exponent), slope), x)


def _through(g: tuple[int, int], x: Dual) -> Dual:
    """Return g(x), from g and its slope at x."""
    return Dual(g[0] % P, g[1] * x.rate % P)


_OPERATIONS: Mapping[str, Callable[..., Dual]] = {
    ADD: _add,
    SUBTRACT: _subtract,
    NEGATE: _negate,
    MULTIPLY: _multiply,
    DIVIDE: _divide,
    POWER: _raise,
}


def _sine_and_cosine(point: int, x: int) -> tuple[int, int]:
    size, sign = _size(x)
    h = sign * _some(point, "half", size)
    inverse = _inverse(1 + h * h)
    return 2 * h * inverse % P, (1 - h * h) * inverse % P


def _exponentials(point: int, x: int) -> tuple[int, int]:
    """Return exp(x) and exp(-x)."""
    size, sign = _size(x)
    e = _some(point, "exp", size)
    return (e, _inverse(e)) if sign > 0 else (_inverse(e), e)


def _hyperbolic(point: int, x: int) -> tuple[int, int]:
    e, back = _exponentials(point, x)
    half = _inverse(2)
    return (e - back) * half % P, (e + back) * half % P


def _sin(point: int, x: int) -> tuple[int, int]:
    return _sine_and_cosine(point, x)


def _cos(point: int, x: int) -> tuple[int, int]:
    sine, cosine = _sine_and_cosine(point, x)
    return cosine, -sine


def _tan(point: int, x: int) -> tuple[int, int]:
    sine, cosine = _sine_and_cosine(point, x)
    return sine * _inverse(cosine), _inverse(cosine * cosine)


def _exp(point: int, x: int) -> tuple[int, int]:
    e, _ = _exponentials(point, x)
    return e, e


def _sinh(point: int, x: int) -> tuple[int, int]:
    return _hyperbolic(point, x)


def _cosh(point: int, x: int) -> tuple[int, int]:
    sine, cosine = _hyperbolic(point, x)
    return cosine, sine


def _tanh(point: int, x: int) -> tuple[int, int]:
    sine, cosine = _hyperbolic(point, x)
    return sine * _inverse(cosine), _inverse(cosine * cosine)


def _root(point: int, x: int, *, fixed: bool) -> int:
    """Return a square root of either sign; of a constant that has none, any number."""
    root = pow(x, (P + 1) // 4, P)
    if root * root % P != x:
        if not fixed:
            raise NoValueError
        return _some(point, "root", x)
    return root if _some(point, "sign", x) % 2 else -root % P


def _log(point: int, x: int) -> tuple[int, int]:
    return _some(point, "log", x), _inverse(x)


def _atan(point: int, x: int) -> tuple[int, int]:
    size, sign = _size(x)
    return sign * _some(point, "atan", size), _inverse(1 + x * x)


_FUNCTIONS: Mapping[str, Callable[[int, int], tuple[int, int]]] = {
    "sin": _sin,
    "cos": _cos,
    "tan": _tan,
    "atan": _atan,
    "exp": _exp,
    "log": _log,
    "sinh": _sinh,
    "cosh": _cosh,
    "tanh": _tanh,
}
"""Functions of one number at a point, with their slopes."""


def _size(x: int) -> tuple[int, int]:
    """Return one of x and -x, the same for both, and the sign of x then."""
    return (x, 1) if x <= P // 2 else (P - x, -1)


def _some(point: int, name: str, number: int) -> int:
    """Return the number that is chosen for a point, a name and a number."""
    text = f"{point} {name} {number}"
    return int.from_bytes(hashlib.sha256(text.encode()).digest()) % P


def _inverse(number: int) -> int:
    if number % P == 0:
        raise NoValueError
    return pow(number, -1, P)


def _power(number: int, exponent: int) -> int:
    return pow(number if exponent >= 0 else _inverse(number), abs(exponent), P)


def _residue(number: Fraction) -> int:
    return number.numerator * pow(number.denominator, -1, P) % P
