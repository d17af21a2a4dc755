"""The stored energy of a config as a list of operations, recorded from its equations.

It shares neither numbers nor algebra with the prover: a wrong term of the energy that is proved
about shows. An operation takes the results of earlier ones by their numbers; the last is U(Θ):

    ["var", k]                  Θ_k, rad
    ["sum", c0, c, j, c, j]     c0 + Σ c x_j, with rational numbers as text
    ["times", j, k]             a product
    ["pow", n, k]               a whole power, which may be negative
    ["sin", k]                  a function: also cos, exp, log, sqrt, atan
    ["step", k]                 1 where x_k > 0, else 0
"""

from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from functools import partialmethod, total_ordering
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from rbstab.analysis.configuration import configurations
from rbstab.analysis.exact import decimals
from rbstab.config.build import system_of
from rbstab.config.schema import Config
from rbstab.mechanics.numbers import Array

Operations = list[tuple[Any, ...]]

Monomial = tuple[int, ...]
"""A product: entries from 0 are operations, and -k is the entry k >= 3 of a configuration q."""


NOT_QUADRATIC = "its energy is not quadratic in X and in own states"

MAY_JUMP = "the force of an element with modes may jump"


class NoOpinionError(Exception):
    """The energy is of no form that a second opinion can be had of; the message says why."""


class Recorded(NamedTuple):
    """U(Θ), J, the least stored energy at given angles.

    Attributes:
        operations: U.
        stop: The largest |θ2| that a stop allows, rad; None without one.
    """

    operations: Operations
    stop: Fraction | None


@total_ordering
class Number:
    """A polynomial of X, own states and recorded operations. One more kind of number.

    What depends on Θ alone is one operation as soon as it is a factor, or is added to X.
    """

    def __init__(self, tape: Operations, terms: dict[Monomial, Fraction]) -> None:
        self.tape = tape
        self.terms = {m: c for m, c in terms.items() if c}

    @property
    def of_angles(self) -> bool:
        """Whether it depends on Θ alone."""
        return all(k >= 0 for m in self.terms for k in m)

    def number(self) -> Fraction:
        """Return the number that it is.

        Raises:
            TypeError: It depends on the configuration, so code must not branch on it.
        """
        if any(self.terms):
            raise TypeError("a recorded number has no value")
        return self.terms.get((), Fraction(0))

    def single(self) -> "Number":
        """Return it as one operation, or as a number."""
        if not self.of_angles:
            raise NoOpinionError(NOT_QUADRATIC)
        if not any(self.terms) or list(self.terms.items()) == [(max(self.terms), Fraction(1))]:
            return self if len(max(self.terms, default=())) < 2 else self._put(*self._product())
        entries: list[Any] = [str(self.terms.get((), Fraction(0)))]
        for m, c in sorted(self.terms.items()):
            if m:
                entries += [str(c), Number(self.tape, {m: Fraction(1)}).single().operation]
        return self._put("sum", *entries)

    @property
    def operation(self) -> int:
        """The number of the only operation that it is."""
        ((k,),) = self.terms
        return k

    def _product(self) -> tuple[Any, ...]:
        """Return its only monomial as an operation."""
        (m,) = self.terms
        if len(set(m)) == 1:
            return "pow", len(m), m[0]
        return "times", Number(self.tape, {m[:-1]: Fraction(1)}).single().operation, m[-1]

    def _put(self, *operation: Any) -> "Number":
        if operation not in self.tape:
            self.tape.append(operation)
        return Number(self.tape, {(self.tape.index(operation),): Fraction(1)})

    def _like(self, other: Any) -> "Number":
        if isinstance(other, Number):
            return other
        if isinstance(other, np.ndarray):
            return self._like(other.item())
        if isinstance(other, Fraction):
            return Number(self.tape, {(): other})
        if isinstance(other, (bool, int, np.integer)):
            return Number(self.tape, {(): Fraction(int(other))})
        if isinstance(other, (float, np.floating)):
            return Number(self.tape, {(): Fraction(repr(float(other)))})
        raise TypeError(f"a recorded number takes no {type(other).__name__}")

    def __add__(self, other: Any) -> "Number":
        if isinstance(other, np.ndarray):
            return NotImplemented
        one, two = self, self._like(other)
        if one.of_angles != two.of_angles:
            one, two = (x.single() if x.of_angles else x for x in (one, two))
        terms = dict(one.terms)
        for m, c in two.terms.items():
            terms[m] = terms.get(m, Fraction(0)) + c
        return Number(self.tape, terms)

    def __mul__(self, other: Any) -> "Number":
        if isinstance(other, np.ndarray):
            return NotImplemented
        factors = (self, self._like(other))
        one, two = (
            factors
            if any(not any(x.terms) for x in factors)
            else (x.single() if x.of_angles else x for x in factors)
        )
        terms = dict[Monomial, Fraction]()
        for (m, c), (n, d) in product(one.terms.items(), two.terms.items()):
            both = tuple(sorted(m + n))
            terms[both] = terms.get(both, Fraction(0)) + c * d
        return Number(self.tape, terms)

    def __pow__(self, power: Any) -> "Number":
        n = self._like(power).number()
        if n.denominator != 1:
            raise TypeError(f"a power {power!r} of a recorded number is not whole")
        if not any(self.terms):
            return self._like(self.number() ** int(n))
        if self.of_angles and n not in {0, 1}:
            return self._put("pow", int(n), self.single().operation)
        if n < 0:
            raise NoOpinionError(NOT_QUADRATIC)
        found = self._like(1)
        for _ in range(int(n)):
            found = found * self
        return found

    def __neg__(self) -> "Number":
        return self * -1

    def __pos__(self) -> "Number":
        return self

    def __sub__(self, other: Any) -> "Number":
        return NotImplemented if isinstance(other, np.ndarray) else self + -self._like(other)

    def __rsub__(self, other: Any) -> "Number":
        return NotImplemented if isinstance(other, np.ndarray) else -self + other

    def __truediv__(self, other: Any) -> "Number":
        return NotImplemented if isinstance(other, np.ndarray) else self * self._like(other) ** -1

    def __rtruediv__(self, other: Any) -> "Number":
        return NotImplemented if isinstance(other, np.ndarray) else self**-1 * other

    __radd__, __rmul__ = __add__, __mul__

    def __eq__(self, other: object) -> bool:
        return self.number() == self._like(other).number()

    def __lt__(self, other: Any) -> bool:
        return self.number() < self._like(other).number()

    __hash__ = None  # type: ignore[assignment]

    def function(self, kind: str) -> "Number":
        """Return a function of it."""
        x = self.single()
        if not any(x.terms):
            if kind == "step":
                return self._like(x.number() > 0)
            x = x._put("sum", str(x.number()))
        return x._put(kind, x.operation)

    sin = partialmethod(function, "sin")
    cos = partialmethod(function, "cos")
    exp = partialmethod(function, "exp")
    log = partialmethod(function, "log")
    sqrt = partialmethod(function, "sqrt")
    arctan = partialmethod(function, "atan")

    def tan(self) -> "Number":
        """Return its tangent."""
        return self.function("sin") / self.function("cos")


def recorded_energy(config: Config) -> Recorded:
    """Return the energy of a config, from its equations; code of users must be allowed to run.

    Raises:
        NoOpinionError: The energy has no single least value over X and own states that follows by
            elimination, or code of a user takes no such numbers.
    """
    try:
        return _recorded(config)
    except (TypeError, AttributeError, ValueError, ArithmeticError) as error:
        raise NoOpinionError(f"its equations take no other numbers: {error}") from error


def _recorded(config: Config) -> Recorded:
    zero = Number([], {})
    at_rest = configurations(system_of(config, _numbers(zero)))
    q = np.array([zero._put("var", k) for k in range(3)], dtype=object)
    others = [Number(zero.tape, {(-k,): Fraction(1)}) for k in range(3, at_rest.size)]
    q = np.array([*q, *others], dtype=object)
    motion, own = at_rest.motion(q), q[at_rest.pose_size :]
    total, begin, stop = zero, 0, None
    for element in at_rest.system.elements:
        acting: Any = element
        mine = own[begin : begin + element.state_size]
        begin += element.state_size
        if element.holds:  # a stop: it stores nothing, and ends the range
            stop = zero._like(acting.angle).number()
            continue
        if element.mode_count:
            if element.kinked or element.from_user:
                raise NoOpinionError(MAY_JUMP)
            modes = [zero._like(g).function("step") for g in element.guards(motion, mine)]
            acting = replace(acting, mode=np.array(modes, dtype=object))
        total = total + acting.stored(motion, mine)
    for k in range(3, at_rest.size):
        total = _without(total, -k)
    last = _as_squares(total).single()
    if not any(last.terms):
        raise NoOpinionError("its energy does not depend on the angles")
    operations = zero.tape[: last.operation + 1]
    return Recorded(operations, stop)


def _numbers(zero: Number) -> Callable[[Array], Array]:
    """Return the function by which the numbers of a config are recorded."""

    def recorded(values: Array) -> Array:
        exact = decimals(values)
        found = np.empty(values.shape, dtype=object)
        for index in np.ndindex(values.shape):
            found[index] = zero._like(exact[index])
        return found

    return recorded


def _without(total: Number, k: int) -> Number:
    """Return the least value over one entry x: of a x² + b x + c it is c - b²/4a."""
    c, b, a = _powers(total, k)
    if any(a.terms):
        raise NoOpinionError("its stiffness depends on the orientation")
    if not a.number() > 0:
        raise NoOpinionError("nothing holds X, or an own state")
    return _minus_square(c, b, a.number())


def _powers(total: Number, k: int) -> tuple[Number, Number, Number]:
    """Return c, b and a of a x² + b x + c."""
    parts: list[dict[Monomial, Fraction]] = [{}, {}, {}]
    for m, c in total.terms.items():
        degree = m.count(k)
        if degree > 2:
            raise NoOpinionError(NOT_QUADRATIC)
        parts[degree][tuple(i for i in m if i != k)] = c
    first, second, third = (Number(total.tape, part) for part in parts)
    return first, second, third


def _minus_square(c: Number, b: Number, a: Fraction) -> Number:
    """Return c - b²/4a, with like terms together."""
    terms = dict(c.terms)
    for (m, one), (n, other) in product(b.terms.items(), repeat=2):
        both = tuple(sorted(m + n))
        terms[both] = terms.get(both, Fraction(0)) - one * other / (4 * a)
    return Number(c.tape, terms)


def _as_squares(total: Number) -> Number:
    """Return a quadratic polynomial of operations as a sum of squares: a box bounds it better."""
    squares = Number(total.tape, {})
    for k in sorted({k for m in total.terms for k in m}):
        if any(m.count(k) > 2 or len(m) > 2 for m in total.terms if k in m):
            continue
        c, b, a = _powers(total, k)
        if a.terms:
            root = Number(total.tape, {(k,): Fraction(1)}) + b * (1 / (2 * a.number()))
            squares = squares + root**2 * a
            total = _minus_square(c, b, a.number())
    return squares + total
