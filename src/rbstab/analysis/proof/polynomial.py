"""Polynomials in the sines and cosines of angles: one more kind of number for the equations.

The equations accept them like floats and intervals, and return the stored energy as an exact
polynomial. Its coefficients are rational numbers, so nothing is rounded, and terms cancel exactly
before any interval is inserted. A parameter is either the double itself (`Ring.constants`), or the
number that a config means (`Ring.decimals`).
"""

import operator
from collections.abc import Callable, Iterator
from fractions import Fraction
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from rbstab.analysis.exact import decimals
from rbstab.mechanics.numbers import Array

if TYPE_CHECKING:
    from flint import fmpq, fmpq_mpoly, fmpq_mpoly_ctx


def rational(number: Any) -> "fmpq":
    """Convert a double, an integer or a fraction exactly to a rational number."""
    # Imported late, here and below: only proofs need it.
    from flint import fmpq

    return fmpq(*number.as_integer_ratio())


def fraction(number: "fmpq") -> Fraction:
    """Convert a rational number to a `Fraction`; `float()` of it is correctly rounded."""
    return Fraction(int(number.p), int(number.q))


class Powers(NamedTuple):
    """The powers of a term: of each θ, sin θ, cos θ, x, z and ℓ."""

    angles: tuple[int, ...]
    sines: tuple[int, ...]
    cosines: tuple[int, ...]
    lengths: tuple[int, ...]
    parameters: tuple[int, ...]
    roots: tuple[int, ...]


class Ring:
    """The polynomials in some angles, their sines and cosines, some lengths and some parameters.

    A square root of a polynomial in sines and cosines is one more variable ℓ, if there is one left:
    ℓ² is that polynomial, its `squares` entry. Else the root is the unknown value. With
    `roots_of_lengths` the polynomial may have the variables x too.

    Args:
        angles: The number of angles θ.
        lengths: The number of further variables x, which have no sine.
        parameters: The number of variables z in [-1, 1] that place a body in a box of bodies.
        roots: The largest number of variables ℓ.
        roots_of_lengths: Whether ℓ² may depend on x.
    """

    def __init__(
        self,
        angles: int,
        lengths: int,
        parameters: int = 0,
        roots: int = 0,
        *,
        roots_of_lengths: bool = False,
    ) -> None:
        self.angles, self.lengths, self.parameters = angles, lengths, parameters
        self.roots, self.roots_of_lengths = roots, roots_of_lengths
        self.squares: list[Polynomial] = []

    @cached_property
    def context(self) -> "fmpq_mpoly_ctx":
        """The variables in flint's order: all θ, all sin θ, all cos θ, all x, all z, all ℓ."""
        from flint import Ordering, fmpq_mpoly_ctx

        kinds = {"theta": self.angles, "s": self.angles, "c": self.angles, "x": self.lengths}
        kinds |= {"z": self.parameters, "l": self.roots}
        names = [f"{kind}{index}" for kind, count in kinds.items() for index in range(count)]
        return fmpq_mpoly_ctx.get(names, Ordering.lex)

    def constant(self, number: Any) -> "Polynomial":
        """Return the constant polynomial of a double, an integer or a fraction."""
        return self.number(rational(number))

    def number(self, value: "fmpq") -> "Polynomial":
        """Return the constant polynomial of a rational number."""
        return Polynomial(self, self.context.constant(value))

    def constants(self, numbers: Array) -> Array:
        """Return an array of doubles as an array of polynomials of the same shape."""
        flat = [self.constant(number) for number in numbers.ravel().tolist()]
        return np.array(flat, dtype=object).reshape(numbers.shape)

    def decimals(self, numbers: Array) -> Array:
        """Return an array of doubles of a config as polynomials: the decimals that they mean."""
        flat = [self.constant(number) for number in decimals(numbers).ravel().tolist()]
        return np.array(flat, dtype=object).reshape(numbers.shape)

    def variables(self) -> Array:
        """Return [θ, x], shape (angles + lengths,)."""
        generators, first_length = self.context.gens(), 3 * self.angles
        lengths = generators[first_length : first_length + self.lengths]
        chosen = [*generators[: self.angles], *lengths]
        return np.array([Polynomial(self, generator) for generator in chosen], dtype=object)

    def split(self, powers: tuple[int, ...]) -> Powers:
        """Return the powers of a term by kind of variable."""
        n, last = self.angles, 3 * self.angles + self.lengths
        angles, sines, cosines = powers[:n], powers[n : 2 * n], powers[2 * n : 3 * n]
        end = last + self.parameters
        return Powers(angles, sines, cosines, powers[3 * n : last], powers[last:end], powers[end:])

    def parameter(self, index: int) -> "Polynomial":
        """Return one of the variables z."""
        return Polynomial(self, self.context.gens()[3 * self.angles + self.lengths + index])

    def quotient(self, dividend: Any, divisor: Any) -> Any:
        """Divide by a constant other than 0; any other divisor gives the unknown value (None)."""
        if hasattr(divisor, "is_constant"):
            divisor = divisor.leading_coefficient() if divisor.is_constant() else 0
        return dividend * (1 / divisor) if divisor != 0 else None

    def root_of(self, value: "Polynomial") -> "fmpq_mpoly | None":
        """Return the variable ℓ of the square root of a known polynomial; None if there is none."""
        for powers, _ in value.terms():
            term = self.split(powers)
            lengths = () if self.roots_of_lengths else term.lengths
            if any(term.angles + lengths + term.parameters + term.roots):
                return None
        places = (k for k, square in enumerate(self.squares) if square.value == value.value)
        place = next(places, len(self.squares))
        if place == self.roots:
            return None
        if place == len(self.squares):
            self.squares.append(value)
        return self.context.gens()[3 * self.angles + self.lengths + self.parameters + place]

    def angle_of(self, value: "fmpq_mpoly") -> int | None:
        """Return the index of the angle that a polynomial equals, or None if it equals no angle."""
        generators = self.context.gens()[: self.angles]
        return next((k for k, generator in enumerate(generators) if value == generator), None)


class Polynomial:
    """One polynomial, or the unknown value.

    A division by a polynomial that is not constant gives the unknown value, and so does the sine of
    a sum, and a square root for which the ring has no variable. It may occur (the rate matrix B has
    1/cos θ2), but an energy must not depend on it.

    Args:
        ring: The ring.
        value: The polynomial, or None for the unknown value.
    """

    def __init__(self, ring: Ring, value: "fmpq_mpoly | None") -> None:
        self.ring, self.value = ring, value

    @property
    def known(self) -> bool:
        """Whether this is a polynomial, not the unknown value."""
        return self.value is not None

    @property
    def is_zero(self) -> bool:
        """Whether all coefficients of a known polynomial are zero."""
        return self.value is not None and not self.value.to_dict()

    @property
    def degree(self) -> int:
        """The total degree in the lengths x."""
        return max((sum(self._lengths(powers)) for powers, _ in self.terms()), default=0)

    def terms(self) -> Iterator[tuple[tuple[int, ...], "fmpq"]]:
        """Yield each term's powers, in the order of `Ring.context`, and its coefficient."""
        assert self.value is not None
        for powers, coefficient in self.value.to_dict().items():
            yield tuple(int(power) for power in powers), coefficient

    @property
    def constant_value(self) -> "fmpq | None":
        """The value of a constant polynomial, or None if it depends on a variable."""
        if self.value is None or not self.value.is_constant():
            return None
        return self.value.leading_coefficient()

    def length_coefficient(self, *wanted: int) -> "Polynomial":
        """Return the coefficient of a product of lengths, a polynomial in the angles and in z.

        Args:
            wanted: The indices of the lengths; give none for the terms without lengths.
        """
        powers = tuple(wanted.count(index) for index in range(self.ring.lengths))
        cut, end = 3 * self.ring.angles, 3 * self.ring.angles + self.ring.lengths
        found = {
            (*term[:cut], *[0] * self.ring.lengths, *term[end:]): coefficient
            for term, coefficient in self.terms()
            if self._lengths(term) == powers
        }
        return Polynomial(self.ring, self.ring.context.from_dict(found))

    def slope(self, place: int) -> "Polynomial":
        """Return the derivative of a known polynomial by a length x."""
        assert self.value is not None
        return Polynomial(self.ring, self.value.derivative(3 * self.ring.angles + place))

    def _lengths(self, powers: tuple[int, ...]) -> tuple[int, ...]:
        return self.ring.split(powers).lengths

    def sin(self) -> "Polynomial":
        """Return the sine of an angle."""
        return self._sine_or_cosine(0)

    def cos(self) -> "Polynomial":
        """Return the cosine of an angle."""
        return self._sine_or_cosine(1)

    def sqrt(self) -> "Polynomial":
        """Return the square root: a variable ℓ, or the unknown value."""
        return Polynomial(self.ring, self.ring.root_of(self) if self.known else None)

    def _sine_or_cosine(self, kind: int) -> "Polynomial":
        index = None if self.value is None else self.ring.angle_of(self.value)
        if index is None:
            return Polynomial(self.ring, None)
        place = self.ring.angles * (1 + kind) + index
        return Polynomial(self.ring, self.ring.context.gens()[place])

    def _combine(self, other: Any, operation: Callable[[Any, Any], Any]) -> "Polynomial":
        if isinstance(other, np.ndarray):
            return NotImplemented  # numpy takes over, entry by entry
        value = other.value if isinstance(other, Polynomial) else rational(other)
        unknown = self.value is None or value is None
        return Polynomial(self.ring, None if unknown else operation(self.value, value))

    def __add__(self, other: Any) -> "Polynomial":
        return self._combine(other, operator.add)

    def __mul__(self, other: Any) -> "Polynomial":
        return self._combine(other, operator.mul)

    def __truediv__(self, other: Any) -> "Polynomial":
        return self._combine(other, self.ring.quotient)

    def __rtruediv__(self, other: Any) -> "Polynomial":
        return NotImplemented if isinstance(other, np.ndarray) else self.ring.constant(other) / self

    def __neg__(self) -> "Polynomial":
        return self * -1

    def __sub__(self, other: Any) -> "Polynomial":
        return self + -other

    def __rsub__(self, other: Any) -> "Polynomial":
        return -self + other

    __radd__ = __add__
    __rmul__ = __mul__


def exact_number(value: Any) -> Fraction:
    """Return a parameter of an exact system as a fraction."""
    number = np.asarray(value, dtype=object).item()
    if isinstance(number, Polynomial):
        constant = number.constant_value
        assert constant is not None
        return fraction(constant)
    return Fraction(number)
