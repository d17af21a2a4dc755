"""Energies and powers without round-off: the equations in numbers of 1024 bits with error bounds.

Such a number is a ball: it has a proved bound on its error (python-flint's `arb`). States and
parameters are doubles, and each double is an exact ball. So the certificate can tell a wrong
equation from terms that cancel in double precision. Proofs take the numbers of a config as decimals
instead.
"""

import math
from collections.abc import Callable
from contextlib import AbstractContextManager, suppress
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from rbstab.analysis.configuration import configurations
from rbstab.analysis.rest_state import RestState
from rbstab.mechanics.derivatives import jacobian
from rbstab.mechanics.numbers import Array, entrywise
from rbstab.systems.parameters import map_parameters
from rbstab.systems.system import Observation, System

PRECISION = 1024
"""Bits of a ball. Terms of 1e150 may cancel down to 1e-150."""

STEP_EXPONENT = -4096
"""The complex step is 2 to this power; its error is of the order of its square."""

Ball = Any


class ExactPowers(NamedTuple):
    """The powers at a state, W, as balls.

    Attributes:
        by_part: The rate of each part of the energy along the motion (∇v·f, by part).
        contact: F'Λ, the power of the contact force.
        rate: v', the sum of what is supplied minus the sum of the dissipations.
        terms: The sum of |∂E/∂y_i ẏ_i| over all parts E and states y_i, in double precision.
    """

    by_part: list[Ball]
    contact: Ball
    rate: Ball
    terms: float


def ball(x: float) -> Ball:
    """Return a double as an exact ball."""
    from flint import arb  # imported late: most runs need no balls

    return arb(x)


def exactly() -> AbstractContextManager[None]:
    """Return a context in which balls have `PRECISION` bits."""
    from flint import ctx

    context: AbstractContextManager[None] = ctx.workprec(PRECISION)
    return context


def in_balls(compute: Callable[[], Any]) -> Any:
    """Return compute(), with balls of `PRECISION` bits.

    Returns:
        The result; None if an element does not accept balls.
    """
    with exactly(), suppress(TypeError, AttributeError):
        return compute()
    return None


def exact_powers(system: System, y: Array, t: float = 0.0) -> ExactPowers:
    """Return the powers of a system at a state vector; call it by `in_balls`.

    Args:
        system: The system.
        y: The state vector, shape (n,).
        t: The time, s.
    """
    from flint import acb, arb

    exact, state, time = exact_system(system), balls(y), ball(t)
    step = arb(2) ** STEP_EXPONENT
    moved = [acb(x, step * rate) for x, rate in zip(state, exact.rates(state, time), strict=True)]
    energy = exact.observe(np.array(moved, dtype=object), time).energy
    observation = exact.observe(state, time)
    rates = system.rates(y, t)
    return ExactPowers(
        [acb(part).imag / step for part in energy],
        sum((observation.motion.F * observation.contact_force).tolist(), arb(0)),
        sum(observation.supplied.tolist(), arb(0)) - sum(observation.dissipation.tolist(), arb(0)),
        float(np.abs(jacobian(lambda z: system.observe(z, t).energy, y) * rates).sum()),
    )


def exact_observation(system: System, y: Array, t: float = 0.0) -> Observation:
    """Return what is observed at a state vector, as balls; call it by `in_balls`.

    Args:
        system: The system.
        y: The state vector, shape (n,).
        t: The time, s.
    """
    return exact_system(system).observe(balls(y), ball(t))


def exact_rest_energy(system: System, rest: RestState) -> Ball:
    """Return the energy of a rest state of a system, J; call it by `in_balls`."""
    at_rest = configurations(exact_system(system))
    return ball(0.0) + at_rest.energy(
        balls(at_rest.configuration(rest.motion, rest.element_states))
    )


def exact_system(system: System) -> System:
    """Return the system with its parameters as balls."""
    return map_parameters(system, lambda _, value: balls(value))


def balls(values: Array) -> Array:
    """Return an array of doubles as an object array of balls, in the same shape."""
    return entrywise(ball, values)


def upper(number: Ball) -> float:
    """Return a double that is not below any number of a ball; NaN for a ball of no bound."""
    return math.nextafter(float(number.upper()), math.inf)


def decimals(values: Array) -> Array:
    """Return the numbers that the doubles of a config mean, as fractions: 0.4 is 2/5.

    A double means the shortest decimal that reads as the same double. Fractions stay as they are.

    Raises:
        OverflowError: A double is not finite.
    """
    return entrywise(_decimal, values)


def _decimal(value: Any) -> Fraction:
    if isinstance(value, Fraction):
        return value
    if not math.isfinite(value):
        raise OverflowError(f"{value} is not a finite number")
    return Fraction(repr(float(value)))


def decimal_balls(values: Array) -> Array:
    """Return the numbers that the doubles of a config mean, as balls of the current precision."""
    return entrywise(fraction_ball, decimals(values))


def fraction_ball(number: Fraction) -> Ball:
    """Return a fraction as a ball of the current precision."""
    from flint import arb, fmpq  # imported late, as in `ball`

    return arb(fmpq(number.numerator, number.denominator))


def is_positive_definite(matrix: Array, *, or_semi: bool = False) -> bool:
    """Return whether the symmetric part of a square matrix is positive definite.

    Args:
        matrix: The matrix, of doubles or of rational numbers, shape (n, n).
        or_semi: Whether eigenvalues may also be zero.
    """
    rank = exact_rank(matrix)
    return rank is not None and (or_semi or rank == len(matrix))


def exact_rank(matrix: Array) -> int | None:
    """Return the rank of the symmetric part of a square matrix; None if an eigenvalue is negative.

    If none of the eigenvalues λ is negative, no coefficient of the polynomial Π (x + λ) is, and as
    many as their rank follow its first one that is not zero. All are rational, without round-off.

    Args:
        matrix: The matrix, of doubles or of rational numbers, shape (n, n).
    """
    exact = _rational(matrix)
    # Of twice the symmetric part, (-1)^n det(-xI - M).
    coefficients = (exact + exact.transpose()).charpoly().coeffs()[::-1]
    signed = [(-1) ** order * coefficient for order, coefficient in enumerate(coefficients)]
    return None if min(signed) < 0 else sum(entry > 0 for entry in signed) - 1


def kernel(matrix: Array) -> list[Array]:
    """Return a basis of the x with Mx = 0, in rational numbers.

    Each vector of it has one entry 1 where all others have 0, as far behind as possible.

    Args:
        matrix: M, of doubles or of rational numbers, shape (m, n).
    """
    reduced, rank = _rational(matrix).rref()
    rows = [[Fraction(int(x.p), int(x.q)) for x in row] for row in reduced.tolist()[:rank]]
    pivots = [next(k for k, entry in enumerate(row) if entry) for row in rows]
    basis = []
    for free in sorted(set(range(matrix.shape[1])) - set(pivots)):
        vector = np.array([Fraction(k == free) for k in range(matrix.shape[1])], dtype=object)
        vector[pivots] = [-row[free] for row in rows]
        basis.append(vector)
    return basis


def _rational(matrix: Array) -> Any:
    """Return a matrix of doubles or of rational numbers as one of python-flint, exactly."""
    from flint import fmpq, fmpq_mat  # imported late, as in `ball`

    rows, columns = matrix.shape
    numbers = [fmpq(*Fraction(x).as_integer_ratio()) for x in matrix.ravel().tolist()]
    return fmpq_mat(rows, columns, numbers)
