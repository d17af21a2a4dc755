"""The numbers of a box of bodies, and polynomials in them."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np

from rbstab.analysis.exact import decimals
from rbstab.analysis.proof.polynomial import Polynomial, Ring
from rbstab.mechanics.numbers import Array
from rbstab.systems.system import System

if TYPE_CHECKING:
    from flint import fmpq, fmpq_mpoly

Members = Callable[[Sequence[Any], Callable[[Array], Array]], System]
"""A function that builds the system of a member.

Its arguments are the numbers that have a tolerance, in any kind of number, and the conversion of
arrays of all numbers. Such an array may contain doubles and numbers that are converted already.
"""

RECIPROCALS = 4
"""The number of different divisors that depend on a number with a tolerance."""

SERIES = 8
"""The number of terms of the series of a reciprocal."""


@dataclass(frozen=True)
class Part:
    """A box of bodies: the number p_k is in [middle_k - radius_k, middle_k + radius_k]."""

    middle: tuple[Fraction, ...]
    radius: tuple[Fraction, ...]

    def halves(self, axis: int) -> "tuple[Part, Part]":
        """Cut the box in two along one number. The halves share a face, so they cover the box."""
        radius = list(self.radius)
        radius[axis] /= 2
        found = []
        for sign in (-1, 1):
            middle = list(self.middle)
            middle[axis] += sign * radius[axis]
            found.append(Part(tuple(middle), tuple(radius)))
        return found[0], found[1]

    def share_of(self, whole: "Part") -> Fraction:
        """Return the volume of this part over that of the box of which it is a part."""
        pairs = zip(self.radius, whole.radius, strict=True)
        return math.prod((own / of_whole for own, of_whole in pairs if of_whole), start=Fraction(1))

    @property
    def centre(self) -> "Part":
        """The body in the middle, as a box without width."""
        return Part(self.middle, (Fraction(0),) * len(self.middle))


class BodiesRing(Ring):
    """The polynomials in angles, lengths and z, with the reciprocals of polynomials in z.

    A reciprocal is a series with a remainder, and the remainder is a further variable in [-1, 1].

    Args:
        lengths: The number of variables x.
        part: The box of bodies. A number with the radius 0 has no variable z.
    """

    def __init__(self, lengths: int, part: Part) -> None:
        self.part = part
        self.varied = [k for k, radius in enumerate(part.radius) if radius > 0]
        super().__init__(3, lengths, len(self.varied) + RECIPROCALS)
        self._reciprocals: list[tuple[Any, Any]] = []

    @property
    def numbers(self) -> list[Polynomial]:
        """The numbers p_k = middle_k + radius_k z_k."""
        found = [self.constant(middle) for middle in self.part.middle]
        for place, k in enumerate(self.varied):
            found[k] = found[k] + self.parameter(place) * self.part.radius[k]
        return found

    def converted(self, numbers: Array) -> Array:
        """Convert the doubles of an array to the decimals that they mean; leave polynomials."""
        entries = np.empty(numbers.shape, dtype=object)
        for index in np.ndindex(numbers.shape):
            entry = numbers[index]
            if not isinstance(entry, Polynomial):
                entries[index] = self.constant(decimals(np.array(float(entry)))[()])
            else:
                entries[index] = entry
        return entries

    def quotient(self, dividend: Any, divisor: Any) -> Any:
        """Divide by a constant, or by a polynomial in z without zeros; else return None."""
        found = super().quotient(dividend, divisor)
        if found is not None or not hasattr(divisor, "is_constant") or divisor == 0:
            return found
        reciprocal = self._reciprocal(divisor)
        return None if reciprocal is None else dividend * reciprocal

    def _reciprocal(self, divisor: "fmpq_mpoly") -> "fmpq_mpoly | None":
        """Return the reciprocal of q as a polynomial in z and w, with |w| <= 1.

        1/q = (1 - d + d² - ...)/q0 + w δⁿ/((1 - δ) |q0|), with n terms in brackets, where
        q = q0 (1 + d) and |d| <= δ < 1.
        """
        for known, reciprocal in self._reciprocals:
            if known == divisor:
                return reciprocal
        sizes = z_sizes(self, divisor)
        if sizes is None or len(self._reciprocals) == RECIPROCALS:
            return None
        middle, spread = sizes
        if middle == 0 or spread >= abs(middle):
            return None
        delta = spread / abs(middle)
        deviation = divisor * (1 / middle) - 1
        series, power = 0 * divisor + 1, 0 * divisor + 1
        for _ in range(SERIES - 1):
            power = power * deviation * -1
            series = series + power
        place = len(self.varied) + len(self._reciprocals)
        w: Any = self.parameter(place).value
        found = series * (1 / middle) + w * (delta**SERIES / ((1 - delta) * abs(middle)))
        self._reciprocals.append((divisor, found))
        return found


def z_sizes(ring: Ring, value: "fmpq_mpoly") -> "tuple[fmpq, fmpq] | None":
    """Return the constant term of a polynomial in z, and a bound on the sum of all other terms.

    None if the polynomial depends on an angle or a length.
    """
    from flint import fmpq  # imported late, as in `polynomial`

    middle, spread = fmpq(0), fmpq(0)
    first = 3 * ring.angles + ring.lengths
    for powers, coefficient in value.to_dict().items():
        if any(powers[:first]):
            return None
        if any(powers):
            spread += abs(coefficient)
        else:
            middle = coefficient
    return middle, spread
