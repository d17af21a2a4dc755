"""Exact expressions: polynomials over atoms with rational coefficients. One more kind of number.

The equations of a system take these numbers, and return their energy exactly. An atom is a
variable, the sine or cosine of an expression, or another function of one (`sqrt`, `exp`, `step`).
sin² is always written as 1 - cos², so equal trigonometric polynomials are equal expressions:
A'A = I cancels, and "is it quadratic in x?" is a question about monomials. Products with other
functions keep sums as factors (`LET`): (ℓ/ℓ₀ - 1)³ is sharper over a box than its terms.

Expressions and atoms are the same for the same content in every process, and so is their order.
"""

import hashlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from fractions import Fraction
from functools import reduce, total_ordering
from operator import mul
from typing import Any, Union
from weakref import WeakValueDictionary

import numpy as np

from rbstab.mechanics.numbers import entrywise, root_excess
from rbstab.proof.exact.atoms import (
    COS,
    LET,
    SIN,
    STEP,
    VAR,
    Atom,
    Monomial,
    term_order,
    times,
)
from rbstab.proof.exact.decimals import as_decimal, meant

_most_products = ContextVar("most products", default=20_000)
"""Products of sums with more pairs of terms are not multiplied out."""


@contextmanager
def factored() -> Iterator[None]:
    """Return a context in which no product of sums is multiplied out."""
    token = _most_products.set(0)
    try:
        yield
    finally:
        _most_products.reset(token)


SMALL_EXCESS = 1e-4
"""If all coefficients of x are below it, √(1 + x) - 1 is a quotient."""

_atoms: WeakValueDictionary[tuple[str, Any, Any], Atom] = WeakValueDictionary()
"""The atoms in memory, so that equal ones are one."""


def atom(kind: str, argument: Union[int, "Expr"], extra: Union[int, "Expr", None] = None) -> Atom:
    """Return the atom of a kind and an argument.

    Args:
        kind: Its kind, see `Atom`.
        argument: The number of a variable, or an expression.
        extra: As for `Atom`; None for other kinds.
    """
    name = argument.digest if isinstance(argument, Expr) else argument
    more = extra.digest if isinstance(extra, Expr) else extra
    a = _atoms.get((kind, name, more))
    if a is None:
        a = Atom()
        a.kind, a.argument, a.extra = kind, argument, extra
        if isinstance(argument, Expr):
            a.variables = argument.variables
            number = variable_of(argument)
        else:
            a.variables, number = frozenset({argument}), argument
        # Variables and their sines and cosines come first.
        plain = number is not None and kind in {VAR, SIN, COS}
        a.order = (0, f"{number:04d} {kind}") if plain else (1, f"{name} {kind} {more}")
        _atoms[kind, name, more] = a
    return a


def variable_of(e: "Expr") -> int | None:
    """Return the number of the variable that an expression is; None if it is none."""
    if len(e.terms) == 1:
        ((m, c),) = e.terms.items()
        if c == 1 and len(m) == 1 and m[0][1] == 1 and m[0][0].kind == VAR:
            number = m[0][0].argument
            assert isinstance(number, int)
            return number
    return None


def _with_expr(operation: Callable[["Expr", "Expr"], "Expr"]) -> Callable[["Expr", Any], Any]:
    """Return an operation that takes a number too, and leaves an array to that of arrays."""

    def of_both(self: "Expr", other: Any) -> Any:
        return NotImplemented if isinstance(other, np.ndarray) else operation(self, expr(other))

    return of_both


def _multiplied(first: "Expr", second: "Expr") -> "Expr":
    """Return a product; sums with other functions stay as factors."""
    for factor, left in ((first, second), (second, first)):
        if factor.constant is not None:
            return left.scaled(factor.constant)
    if first.digest == second.digest:
        return first**2
    plain = first.is_polynomial and second.is_polynomial
    plain = plain and len(first.terms) * len(second.terms) <= _most_products.get()
    if not (plain or first.is_switch or second.is_switch):
        first, second = as_factor(first), as_factor(second)
    return product(first, second)


def _named(kind: str) -> Callable[["Expr"], "Expr"]:
    """Return the function of a kind, as numpy calls it on the entries of an array."""
    return lambda self: self.function(kind)


@total_ordering
class Expr:
    """Σ c Π atom^power.

    Args:
        terms: c of each monomial; zeros are left out.
    """

    __slots__ = ("_digest", "_variables", "terms")

    def __init__(self, terms: Mapping[Monomial, Fraction]) -> None:
        self.terms: dict[Monomial, Fraction] = {m: c for m, c in terms.items() if c}
        self._digest: str | None = None
        self._variables: frozenset[int] | None = None

    # -- what it is ---------------------------------------------------------------------------

    @property
    def digest(self) -> str:
        """A text that only equal expressions share."""
        if self._digest is None:
            rows = [
                f"{c} " + " ".join(f"{a.order[1]}^{p}" for a, p in m)
                for m, c in sorted(self.terms.items(), key=term_order)
            ]
            self._digest = hashlib.blake2b("\n".join(rows).encode(), digest_size=16).hexdigest()
        return self._digest

    @property
    def constant(self) -> Fraction | None:
        """The number that it is; None if it is none."""
        if not self.terms:
            return Fraction(0)
        return self.terms.get(()) if len(self.terms) == 1 else None

    @property
    def atoms(self) -> set[Atom]:
        """The atoms of its monomials."""
        return {a for m in self.terms for a, _ in m}

    @property
    def all_atoms(self) -> set[Atom]:
        """Its atoms, with those inside functions."""
        atoms, pending = set[Atom](), list(self.atoms)
        while pending:
            a = pending.pop()
            if a not in atoms:
                atoms.add(a)
                pending += [] if a.kind == VAR else a.inner.atoms
        return atoms

    @property
    def variables(self) -> frozenset[int]:
        """The numbers of the variables on which it depends, also inside functions."""
        if self._variables is None:
            self._variables = frozenset[int]().union(*(a.variables for a in self.atoms))
        return self._variables

    @property
    def is_polynomial(self) -> bool:
        """Whether it is a polynomial of variables, sines and cosines, which is multiplied out."""
        return all(a.kind in {VAR, SIN, COS} and p > 0 for m in self.terms for a, p in m)

    @property
    def is_switch(self) -> bool:
        """Whether it is one product of steps: a factor of each term, so that terms cancel."""
        return len(self.terms) == 1 and all(a.kind == STEP for a in self.atoms)

    def __repr__(self) -> str:
        """Return the expression as a formula."""
        shown = []
        for m, c in sorted(self.terms.items(), key=term_order):
            factors = [repr(a) if p == 1 else f"{a!r}^{p}" for a, p in m]
            shown.append("*".join([str(c), *factors] if c != 1 or not m else factors))
        return " + ".join(shown) or "0"

    # -- arithmetic ---------------------------------------------------------------------------

    __add__ = __radd__ = _with_expr(lambda one, two: summed((one, two)))
    __sub__ = _with_expr(lambda one, two: one + -two)
    __rsub__ = _with_expr(lambda one, two: two + -one)
    __mul__ = __rmul__ = _with_expr(_multiplied)
    __truediv__ = _with_expr(lambda one, two: one * two**-1)
    __rtruediv__ = _with_expr(lambda one, two: two * one**-1)

    def scaled(self, factor: Fraction) -> "Expr":
        """Return the product with a number."""
        return Expr({m: c * factor for m, c in self.terms.items()})

    def __neg__(self) -> "Expr":
        """Return its negative."""
        return self.scaled(Fraction(-1))

    def __pow__(self, power: Any) -> "Expr":
        """Return a whole power, which may be negative.

        Raises:
            TypeError: The power is not whole.
        """
        n = _whole(power)
        if self.constant is not None:
            return Expr({(): self.constant**n})
        if n == 0:
            return expr(1)
        if n < 0 or not self.is_polynomial or len(self.terms) ** 2 > _most_products.get():
            ((m, c),) = as_factor(self).terms.items()
            return _reduced(Expr({tuple((a, p * n) for a, p in m): c**n}))
        raised = self
        for _ in range(n - 1):
            raised = product(raised, self)
        return raised

    # -- a number may be compared, an expression of variables may not ---------------------------

    def _number(self) -> Fraction:
        if self.constant is None:
            raise TypeError("an expression has no value, so code must not branch on it")
        return self.constant

    def __eq__(self, other: object) -> bool:
        """Return whether two expressions are the same; what varies is compared with no number."""
        if isinstance(other, Expr):
            return self.digest == other.digest
        if isinstance(other, (int, float, Fraction)):
            return self._number() == meant(other)
        return NotImplemented

    def __hash__(self) -> int:
        """Return a number that equal expressions share."""
        return hash(self.digest)

    def __lt__(self, other: Any) -> bool:
        """Compare two numbers."""
        return self._number() < expr(other)._number()

    def __bool__(self) -> bool:
        """Return whether a number is not zero."""
        return self._number() != 0

    # -- functions ------------------------------------------------------------------------------

    def function(self, kind: str, extra: Union[int, "Expr", None] = None) -> "Expr":
        """Return a function of it."""
        if kind == LET:
            return self
        if kind in {SIN, COS} and not self.terms:
            return expr(kind == COS)
        return only(atom(kind, self, extra))

    sin, cos = _named(SIN), _named(COS)
    sqrt, exp, log, atan = _named("sqrt"), _named("exp"), _named("log"), _named("atan")

    def tan(self) -> "Expr":
        """Return its tangent."""
        return self.sin() / self.cos()

    def sinh(self) -> "Expr":
        """Return its hyperbolic sine."""
        return (self.exp() - (-self).exp()) / 2

    def cosh(self) -> "Expr":
        """Return its hyperbolic cosine."""
        return (self.exp() + (-self).exp()) / 2

    def tanh(self) -> "Expr":
        """Return its hyperbolic tangent."""
        return 1 - 2 / ((2 * self).exp() + 1)

    def step(self, smooth: int) -> "Expr":
        """Return 1 where it is positive, else 0.

        Args:
            smooth: The order of the first derivative that may jump of the sum in which the step
                stands: 1 for a force that jumps, 2 for one with a kink.
        """
        return self.function(STEP, smooth)


@root_excess.register(Expr)
def _root_excess(x: Any) -> Expr:
    """Return √(1 + x²) - 1."""
    # One function, of a square, has sharper bounds than a quotient of two. But where x is small the
    # difference has few digits, as of a limit that is far above all forces.
    square = as_factor(x) ** 2
    root = (1 + square).sqrt()
    small = all(abs(c) < SMALL_EXCESS for c in (x * x).terms.values())
    return square / (1 + root) if small else root - 1


def expr(x: Any) -> Expr:
    """Return a number as an expression."""
    if isinstance(x, Expr):
        return x
    if isinstance(x, np.ndarray):
        return expr(x.item())
    return Expr({(): meant(x)})


def only(a: Atom) -> Expr:
    """Return an atom as an expression."""
    return Expr({((a, 1),): Fraction(1)})


def variable(number: int) -> Expr:
    """Return the variable with a number."""
    return only(atom(VAR, number))


def variables(places: Iterable[int]) -> np.ndarray[Any, Any]:
    """Return variables as an array."""
    return np.array([variable(k) for k in places], dtype=object)


def as_factor(e: Expr) -> Expr:
    """Return an expression as one monomial: a sum becomes an atom of its own."""
    return e if len(e.terms) == 1 else only(atom(LET, e))


def numbers(values: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Return an array of doubles of a config as the numbers that they mean."""

    def exact(entry: Any) -> Expr:
        return entry if isinstance(entry, Expr) else Expr({(): as_decimal(entry)})

    return entrywise(exact, values)


def _whole(power: Any) -> int:
    number = power.constant if isinstance(power, Expr) else meant(power)
    if number is None or number.denominator != 1:
        raise TypeError(f"a power {power!r} of an expression is not whole")
    return int(number)


def collected(terms: Iterable[tuple[Monomial, Fraction]]) -> Expr:
    """Return the sum of some terms."""
    coefficients: dict[Monomial, Fraction] = {}
    for m, c in terms:
        coefficients[m] = coefficients[m] + c if m in coefficients else c
    return Expr(coefficients)


def summed(parts: Iterable[Expr]) -> Expr:
    """Return the sum of some expressions."""
    return collected(term for part in parts for term in part.terms.items())


def mapped(
    e: Expr, change: Callable[[Atom, int], Expr], multiply: Callable[[Expr, Expr], Expr] = mul
) -> Expr:
    """Return an expression with other factors in place of each a^p.

    Args:
        e: The expression.
        change: Returns what takes the place of a^p.
        multiply: Returns the product of two factors.
    """
    return summed(
        reduce(multiply, (change(a, p) for a, p in m), expr(c)) for m, c in e.terms.items()
    )


def same_function(a: Atom, inner: Expr) -> Expr:
    """Return the function that an atom is, of another argument."""
    return as_factor(inner) if a.kind == LET else inner.function(a.kind, a.extra)


def product(first: Expr, second: Expr) -> Expr:
    """Return the product of two sums, multiplied out."""
    pairs = ((m, n) for m in first.terms.items() for n in second.terms.items())
    return _reduced(collected((times(m, n), c * d) for (m, c), (n, d) in pairs))


def _reduced(e: Expr) -> Expr:
    """Return a sum of products, with sin² = 1 - cos² and step² = step."""
    return collected(term for m, c in e.terms.items() for term in _reduced_terms(m, c))


def _reduced_terms(m: Monomial, c: Fraction) -> Iterator[tuple[Monomial, Fraction]]:
    square = next(((a, p) for a, p in m if p >= 2 and a.kind in {SIN, STEP}), None)
    if square is None:
        yield m, c
        return
    a, p = square
    if a.kind == STEP:
        yield from _reduced_terms(times(m, ((a, 1 - p),)), c)
    else:
        less = times(m, ((a, -2),))
        yield from _reduced_terms(less, c)
        yield from _reduced_terms(times(less, ((atom(COS, a.argument), 2),)), -c)
