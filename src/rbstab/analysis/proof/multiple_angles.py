"""Conversion of a polynomial in sines and cosines to a form in multiple angles."""

from fractions import Fraction
from functools import cache
from itertools import product

import numpy as np

from rbstab.analysis.proof.polynomial import Polynomial, fraction
from rbstab.analysis.proof.trigonometric import TrigonometricForm
from rbstab.mechanics.numbers import Array

Exponents = tuple[int, ...]

SMALLEST, LARGEST = 1e-90, 1e90
"""The smallest and the largest number but zero with which proofs compute, in SI units. Products of
three, as in determinants, then neither underflow nor overflow."""


class NotTrigonometric(Exception):
    """A polynomial has a term that a form cannot contain, such as θ³, θ sin θ, or a length."""


def form_of(polynomial: Polynomial) -> TrigonometricForm:
    """Convert a polynomial without lengths to a form in multiple angles.

    Each coefficient is exact and then rounded once. `TrigonometricForm` counts this rounding in the
    error of each term, so its bounds hold for the exact polynomial, whether its numbers are doubles
    or decimals.

    Raises:
        NotTrigonometric: The polynomial has a term that a form cannot contain.
        OverflowError: A coefficient is too small or too large for proofs.
    """
    terms = [(polynomial.ring.split(powers), value) for powers, value in polynomial.terms()]
    highest_multiple = max(
        (sum(pair) for term, _ in terms for pair in zip(term.sines, term.cosines, strict=True)),
        default=0,
    )
    quadratic, linear = np.zeros((3, 3)), np.zeros(3)
    exact: dict[Exponents, Fraction] = {}
    for (angles, sines, cosines, *others), value in terms:
        coefficient = fraction(value)
        if any(map(any, others)):
            raise NotTrigonometric
        if sum(angles) == 0:
            _add_product(exact, coefficient, sines, cosines)
        elif sum(angles) > 2 or any(sines + cosines):
            raise NotTrigonometric
        elif sum(angles) == 1:
            linear[angles.index(1)] = in_doubles(coefficient)
        else:
            i, j = [axis for axis in range(3) for _ in range(angles[axis])]
            quadratic[i, j] = quadratic[j, i] = in_doubles(coefficient * (2 if i == j else 1))
    coefficients = np.zeros([2 * highest_multiple + 1] * 3)
    for place, coefficient in exact.items():
        coefficients[place] = in_doubles(coefficient)
    return TrigonometricForm(quadratic, linear, coefficients)


def has_size(numbers: Array | float) -> bool:
    """Return whether proofs can compute with all of these numbers."""
    sizes = np.abs(numbers)
    return bool(np.all((sizes == 0) | ((sizes >= SMALLEST) & (sizes <= LARGEST))))


def in_doubles(number: Fraction) -> float:
    """Return a number, rounded once.

    Raises:
        OverflowError: It is too small or too large for proofs.
    """
    found = float(number)
    if number and not (found and has_size(found)):
        raise OverflowError(f"{found:g}")
    return found


def _add_product(
    exact: dict[Exponents, Fraction], coefficient: Fraction, sines: Exponents, cosines: Exponents
) -> None:
    """Add a coefficient times Π sinᵖ θ cosᵠ θ to a table of coefficients of t_a t_b t_c."""
    factors = [_power_in_multiples(s, c).items() for s, c in zip(sines, cosines, strict=True)]
    for (a, x), (b, y), (c, z) in product(*factors):
        exact[a, b, c] = exact.get((a, b, c), Fraction(0)) + coefficient * x * y * z


@cache
def _power_in_multiples(sines: int, cosines: int) -> dict[int, Fraction]:
    """Expand sinᵖ θ cosᵠ θ as a sum of the entries of t: their indices and coefficients."""
    if sines + cosines == 0:
        return {0: Fraction(1)}
    by_sine = sines > 0
    rest = _power_in_multiples(sines - by_sine, cosines - (not by_sine))
    found: dict[int, Fraction] = {}
    for place, value in rest.items():
        for target, factor in _times(place, by_sine):
            found[target] = found.get(target, Fraction(0)) + value * factor
    return found


def _times(place: int, by_sine: bool) -> list[tuple[int, Fraction]]:
    """Multiply one entry of t by sin θ or cos θ, using the product formulas."""
    k, half = (place + 1) // 2, Fraction(1, 2)
    if k == 0:
        return [(2 if by_sine else 1, Fraction(1))]
    is_sine = place % 2 == 0
    up, down = 2 * k + 1, 2 * k - 3  # the indices of cos (k+1)θ and cos (k-1)θ
    to_sine = is_sine != by_sine
    # sin kθ cos θ and cos kθ sin θ give sines, cos kθ cos θ and sin kθ sin θ give cosines.
    signs = {(False, False): (1, 1), (False, True): (1, -1), (True, False): (1, 1)}
    first, second = signs.get((is_sine, by_sine), (-1, 1))
    if k == 1:
        lower = [] if to_sine else [(0, second * half)]
    else:
        lower = [(down + to_sine, second * half)]
    return [(up + to_sine, first * half), *lower]
