"""Elimination of X and D for all bodies in a box, with a proved bound on what a series leaves out.

Let H(z) = H0 + Δ(z), S0 = H0⁻¹, and -δH0 <= Δ <= δH0 for all z (as quadratic forms) with δ < 1. For
a polynomial p with |1/(1 + t) - p(t)| <= ε for |t| <= δ,

    H⁻¹ = p(S0 Δ) S0 + R,  |R_ij| <= ε √(S0_ii S0_jj).

With the Chebyshev polynomial c_n, p(t) = (1 - c_n(t/δ)/c_n(-1/δ))/(1 + t) has this property, where
ε = 1/((1 - δ) c_n(1/δ)).
"""

import math
from fractions import Fraction
from itertools import product
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from rbstab.analysis.proof.polynomial import Polynomial, fraction, rational
from rbstab.analysis.proof.reduced_energy import NoEnergyReason, NoReducedEnergy
from rbstab.analysis.proof.robust.numbers import z_sizes

if TYPE_CHECKING:
    from flint import fmpq, fmpq_mat

REMAINDER = 5e-4
"""p gets so many terms that ε is below this part of δ, but at most `MAX_TERMS`."""

MAX_TERMS = 8

MAX_CORNERS = 6
"""δ is computed from all corners of the box, if H depends linearly on at most so many z."""


class Remainder(NamedTuple):
    """A part of U of which only a bound is known: weight times `polynomial`, |weight| <= size.

    variables are the places of the z on which the weight depends.
    """

    size: Fraction
    polynomial: Polynomial
    variables: frozenset[int]


class Eliminated(NamedTuple):
    """U of all bodies in a box: a polynomial in Θ and z, plus the remainders."""

    energy: Polynomial
    remainders: list[Remainder]


class _Block(NamedTuple):
    """The entries of x that are coupled by H, and H for these as a sum of products of z."""

    places: list[int]
    middle: "fmpq_mat"
    deviations: "dict[tuple[int, ...], fmpq_mat]"


def eliminated_for_all(energy: Polynomial) -> Eliminated:
    """Minimize the stored energy of all bodies in a box over x = [X, D].

    Args:
        energy: Π, a polynomial in Θ, x and z, quadratic in x.

    Raises:
        NoReducedEnergy: H depends on Θ, or is not proved to be positive definite for all z.
    """
    reduced, remainders = energy.length_coefficient(), []
    if not energy.ring.lengths:
        return Eliminated(reduced, [])
    for block in _blocks(energy):
        b = [energy.length_coefficient(i) for i in block.places]
        series, inverse, left = _inverse_series(energy, block)
        for i, j in np.ndindex(len(b), len(b)):
            reduced = reduced - b[i] * series[i][j] * b[j] * 0.5
            if left > 0 and i <= j:
                size = left * _root_above(fraction(inverse[i, i] * inverse[j, j]))
                # R is symmetric, so an off-diagonal entry counts twice.
                size /= 1 + (i == j)
                remainders.append(Remainder(size, b[i] * b[j], _variables(energy, block)))
    return Eliminated(reduced, remainders)


def _variables(energy: Polynomial, block: "_Block") -> frozenset[int]:
    split = energy.ring.split
    return frozenset(
        place
        for powers in block.deviations
        for place, power in enumerate(split(powers).parameters)
        if power
    )


def _blocks(energy: Polynomial) -> list[_Block]:
    """Return H in blocks without coupling."""
    ring, count = energy.ring, energy.ring.lengths
    if energy.degree > 2:
        raise NoReducedEnergy(NoEnergyReason.NOT_QUADRATIC)
    rows: list[list[Any]] = [[None] * count for _ in range(count)]
    coupled = [{i} for i in range(count)]
    for i, j in np.ndindex(count, count):
        rows[i][j] = (energy.length_coefficient(i, j) * (1 + (i == j))).value
        if z_sizes(ring, rows[i][j]) is None:
            raise NoReducedEnergy(NoEnergyReason.NOT_QUADRATIC)
        if rows[i][j] != 0:
            union = coupled[i] | coupled[j]
            for k in union:
                coupled[k] = union
    distinct = sorted({tuple(sorted(one)) for one in coupled})
    return [_block(ring.context.nvars(), list(places), rows) for places in distinct]


def _block(variables: int, places: list[int], rows: list[list[Any]]) -> _Block:
    from flint import fmpq_mat  # imported late, as in `polynomial`

    size = len(places)
    found: dict[tuple[int, ...], fmpq_mat] = {}
    for i, j in np.ndindex(size, size):
        for powers, coefficient in rows[places[i]][places[j]].to_dict().items():
            key = tuple(int(power) for power in powers)
            found.setdefault(key, fmpq_mat(size, size))[i, j] = coefficient
    middle = found.pop((0,) * variables, fmpq_mat(size, size))
    return _Block(places, middle, found)


def _inverse_series(
    energy: Polynomial, block: _Block
) -> "tuple[list[list[Polynomial]], fmpq_mat, Fraction]":
    """Return p(S0 Δ) S0, S0 and ε."""
    delta = _relative_deviation(block)
    if delta is None or delta >= 1:
        raise NoReducedEnergy(NoEnergyReason.NOT_HELD)
    inverse, ring = block.middle.inv(), energy.ring
    weights, error = series_of_reciprocal(delta)
    size = range(len(block.places))
    # S0 Δ and p(S0 Δ) S0, as matrices of polynomials.
    factor = [[ring.context.constant(0) for _ in size] for _ in size]
    for powers, matrix in block.deviations.items():
        step = inverse * matrix
        for i, j in np.ndindex(len(size), len(size)):
            if step[i, j] != 0:
                factor[i][j] += ring.context.from_dict({powers: step[i, j]})
    power = [[ring.context.constant(inverse[i, j]) for j in size] for i in size]
    total = [[weights[0] * entry for entry in row] for row in power]
    for weight in weights[1:]:
        power = [
            [sum((factor[i][k] * power[k][j] for k in size), 0 * power[0][0]) for j in size]
            for i in size
        ]
        total = [[total[i][j] + weight * power[i][j] for j in size] for i in size]
    series = [[Polynomial(ring, entry) for entry in row] for row in total]
    return series, inverse, error


def series_of_reciprocal(delta: Fraction) -> "tuple[list[fmpq], Fraction]":
    """Return the coefficients of p, from t⁰ on, and ε; see above."""
    if delta == 0:
        return [rational(1)], Fraction(0)
    # c_n(t/δ) as a list of coefficients, and c_n(1/δ).
    last, now = [Fraction(1)], [Fraction(0), 1 / delta]
    while True:
        at_end = sum(now)
        error = 1 / ((1 - delta) * at_end)
        if error <= REMAINDER * delta or len(now) > MAX_TERMS:
            break
        raised = [Fraction(0), *(2 / delta * x for x in now)]
        lowered = [*last, *[Fraction(0)] * (len(raised) - len(last))]
        last, now = now, [x - y for x, y in zip(raised, lowered, strict=True)]
    degree = len(now) - 1
    left = [-x / ((-1) ** degree * at_end) for x in now]
    left[0] += 1
    # Division by 1 + t from the lowest power on; the last quotient leaves no remainder.
    found: list[Fraction] = []
    for entry in left[:-1]:
        found.append(entry - (found[-1] if found else 0))
    return [rational(entry) for entry in found], error


def _relative_deviation(block: _Block) -> Fraction | None:
    """Return δ with -δH0 <= Δ(z) <= δH0 for all z; None if H0 is not proved positive definite.

    For any matrix F: if |F H0 F' - I| has a norm of at most η < 1, and |F Δ(z) F'| one of at most
    γ, then δ = γ/(1 - η). F is near the inverse of the Cholesky factor of H0. The norm is the
    largest sum of a row of magnitudes.
    """
    from flint import fmpq_mat  # imported late, as in `polynomial`

    size = len(block.places)
    middle = np.array(
        [[float(fraction(block.middle[i, j])) for j in range(size)] for i in range(size)]
    )
    try:
        factor = np.linalg.inv(np.linalg.cholesky(middle))
    except np.linalg.LinAlgError:
        return None
    if not np.all(np.isfinite(factor)):
        return None
    F = fmpq_mat([[rational(x) for x in row] for row in factor.tolist()])
    identity = fmpq_mat([[int(i == j) for j in range(size)] for i in range(size)])
    eta = _norm([F * block.middle * F.transpose() - identity], size)
    if eta >= 1:
        return None
    corners = _corner_deviation(block, F)
    if corners is not None:
        return corners
    gamma = _norm([F * matrix * F.transpose() for matrix in block.deviations.values()], size)
    return gamma / (1 - eta)


def _corner_deviation(block: _Block, F: "fmpq_mat") -> Fraction | None:
    """Return δ, proved at all corners of the box; None if there are too many, or H is not linear.

    A linear function of z lies between its values at the corners.
    """
    if not block.deviations:
        return Fraction(0)
    if len(block.deviations) > MAX_CORNERS or any(sum(powers) > 1 for powers in block.deviations):
        return None
    size, largest, corners = len(block.places), 0.0, []
    middle = F * block.middle * F.transpose()
    for signs in product((-1, 1), repeat=len(block.deviations)):
        corner = 0 * middle
        for sign, matrix in zip(signs, block.deviations.values(), strict=True):
            corner = corner + sign * (F * matrix * F.transpose())
        corners.append(corner)
        entries = [[float(fraction(corner[i, j])) for j in range(size)] for i in range(size)]
        largest = max(largest, float(np.abs(np.linalg.eigvalsh(np.array(entries))).max()))
    delta = Fraction(math.ceil(largest * (1 + 1e-9) * 2**40 + 1), 2**40)
    # With each corner comes its opposite, so one sign is enough.
    held = all(_is_definite(rational(delta) * middle - corner, size) for corner in corners)
    return delta if held else None


def _is_definite(matrix: "fmpq_mat", size: int) -> bool:
    """Return whether a symmetric matrix is positive definite, by its leading minors."""
    from flint import fmpq_mat  # imported late, as in `polynomial`

    rows = [[matrix[i, j] for j in range(size)] for i in range(size)]
    minors = (fmpq_mat([row[:n] for row in rows[:n]]).det() for n in range(1, size + 1))
    return all(fraction(minor) > 0 for minor in minors)


def _norm(matrices: "list[fmpq_mat]", size: int) -> Fraction:
    """Return the largest sum of a row of the sum of the magnitudes of some matrices."""
    sums = [
        sum((fraction(abs(matrix[i, j])) for matrix in matrices for j in range(size)), Fraction(0))
        for i in range(size)
    ]
    return max(sums)


def _root_above(square: Fraction) -> Fraction:
    """Return a number that is not below the root of a number, with some forty digits."""
    scale = 1 << 128
    return Fraction(math.isqrt(math.ceil(square * scale * scale)) + 1, scale)
