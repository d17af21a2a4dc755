"""Whether the own states of an element of a user move down its energy while the body is at rest.

With the energy W of the element and its own states D, it is shown that

    dD/dt = -M ∂W/∂D,        M constant, M + M' positive definite,

where Ω = 0 and V = 0. So D is at rest exactly where ∂W/∂D = 0, and dW/dt < 0 elsewhere. Or, with a
diagonal M, each entry of dD/dt has the sign of the entry u of -M ∂W/∂D by its form: it is r(u)
times a positive factor, where r is odd and rises, as sinh does.

At n points with independent slopes ∂W/∂D, the columns of a matrix S, with the rates R, it follows
that M = -RS⁻¹. That the rates at any point are -M ∂W/∂D with this M is an identity of formulas, and
is compared modulo a prime (`modular.py`). M itself is enclosed at points of real numbers.
"""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from rbstab.analysis.proof.formulas import jets
from rbstab.analysis.proof.formulas.jets import Jet
from rbstab.analysis.proof.formulas.modular import NoValueError, P, values
from rbstab.analysis.proof.formulas.program import (
    LENGTH,
    THETA,
    Operation,
    Program,
    computed,
    part_of,
)
from rbstab.analysis.proof.formulas.signs import Signs
from rbstab.analysis.proof.formulas.terms import AS_ARGUMENT
from rbstab.analysis.proof.lines.intervals import Intervals, exact
from rbstab.integrate.straight_line.number import DIVIDE, MULTIPLY, NEGATE, POWER
from rbstab.mechanics.numbers import Array

if TYPE_CHECKING:
    from flint import arb, arb_mat, fmpz_mod_mat

POINTS = 40
"""The points at which the identity is compared."""

MOST_TRIALS = 2000
"""The points that are tried: some have no values."""

SCALES = (1.0, 0.1, 0.01, 1e-3)
"""The sizes of the own states at which M is enclosed: its bounds may be too wide at one of them."""

BITS = 128
"""Bits of a ball."""


def relaxes(energy: Program, own: range, rates: Sequence[Program]) -> bool:
    """Return whether this is shown.

    Args:
        energy: W, as a formula of Θ and x that has a value everywhere.
        own: The entries of x that are D.
        rates: dD/dt where Ω = 0 and V = 0, as such formulas.
    """
    forces = [_with_sign_of(rate) for rate in rates]
    if _is_one_matrix(energy, own, rates):
        forces = list(rates)
    elif not _is_one_matrix(energy, own, forces, diagonal=True):
        return False
    return any(_moves_down(energy, own, forces, scale) for scale in SCALES)


def _with_sign_of(rate: Program) -> Program:
    """Return a formula with the sign of a rate, without factors and functions that do not count."""
    operations = rate.operations
    signs, index, opposite = Signs(operations), len(operations) - 1, False
    while True:
        kind, *operands = operations[index]
        if kind == NEGATE:
            opposite = not opposite
        elif kind == MULTIPLY and signs.positive(operands[0]):
            operands = operands[1:]
        elif not (
            kind in AS_ARGUMENT
            or (kind == POWER and operands[1] > 0 and operands[1] % 2 == 1)
            or (kind in {MULTIPLY, DIVIDE} and signs.positive(operands[1]))
        ):
            break
        index = operands[0]
    if opposite:
        return part_of([*operations, (NEGATE, index)], len(operations))
    return part_of(operations, index)


def _is_one_matrix(
    energy: Program, own: range, rates: Sequence[Program], *, diagonal: bool = False
) -> bool:
    """Return whether the rates are a constant matrix times the slopes, or a diagonal one."""
    from flint import fmpz_mod_ctx, fmpz_mod_mat  # imported late, as in `polynomial`

    size, context = len(own), fmpz_mod_ctx(P)
    points = _points(energy, own, rates)

    def matrix(count: int) -> "tuple[fmpz_mod_mat, fmpz_mod_mat]":
        """Return the slopes and the rates at further points as columns."""
        columns = [next(points) for _ in range(count)]
        slopes, found = (
            fmpz_mod_mat(
                size, count, [one[part][i] for i in range(size) for one in columns], context
            )
            for part in range(2)
        )
        return slopes, found

    try:
        S, R = matrix(size)
        M = R * S.inv()
        slopes, found = matrix(POINTS)
    except (StopIteration, ZeroDivisionError):
        return False
    places = range(size) if diagonal else ()
    if any(M[i, j] != 0 for i in places for j in places if i != j):
        return False
    return bool(M * slopes == found)


def _points(
    energy: Program, own: range, rates: Sequence[Program]
) -> Iterator[tuple[list[int], list[int]]]:
    """Yield ∂W/∂D and dD/dt modulo the prime, at points at which they have values."""
    for point in range(MOST_TRIALS):
        try:
            slopes = [_at(energy, point, (LENGTH, place)) for place in own]
            found = [_at(rate, point, None) for rate in rates]
        except NoValueError:
            continue
        yield slopes, found


def _at(program: Program, point: int, along: Operation | None) -> int:
    """Return a formula at a point, or its derivative along a variable."""
    operations = program.operations
    moving = {} if along is None else {along: 1}
    value, rate = values(operations, range(len(operations)), moving, point)[-1]
    return value if along is None else rate


def _moves_down(energy: Program, own: range, rates: Sequence[Program], scale: float) -> bool:
    """Return whether M + M' is shown to be positive definite, with M from some points."""
    from flint import ctx

    with ctx.workprec(BITS), np.errstate(all="ignore"):
        M = _enclosed(energy, own, rates, scale)
        if M is None:
            return False
        both, size = M + M.transpose(), len(own)
        return all(_minor(both, count) > 0 for count in range(1, size + 1))


def _enclosed(
    energy: Program, own: range, rates: Sequence[Program], scale: float
) -> "arb_mat | None":
    """Return M in balls, from as many points as there are own states; None if S is singular."""
    size = len(own)
    random = np.random.default_rng(0)
    Theta, x = random.uniform(-1, 1, (size, 3)), random.uniform(-1, 1, (size, own.stop))
    x[:, own.start :] *= scale
    of_energy, *others = (_jet(one, own, Theta, x) for one in (energy, *rates))
    slopes = jets.gradient(of_energy)
    R = _balls([[(one.rows, (0, point)) for point in range(size)] for one in others])
    S = _balls([[(slopes, (point, i)) for point in range(size)] for i in range(size)])
    try:
        return -R * S.inv()
    except ZeroDivisionError:
        return None


def _jet(program: Program, own: range, Theta: Array, x: Array) -> Jet:
    """Return a formula at points, as a function of D."""
    size = len(own)

    def leaf(operation: Operation) -> Jet:
        kind, number = operation
        if kind == LENGTH and number in own:
            return jets.variable(exact(x[:, number]), number - own.start, size)
        if kind not in {THETA, LENGTH}:
            return jets.constant(number, exact(Theta[:, 0]), size)
        found = jets.constant(0.0, exact(Theta[:, 0]), size)
        found.rows.middle[0] = (Theta if kind == THETA else x)[:, number]
        return found

    found: Jet = computed(program, leaf, jets.combined)[-1]
    return found


def _balls(rows: Sequence[Sequence[tuple[Intervals, tuple[int, int]]]]) -> "arb_mat":
    """Return a matrix of entries of intervals."""
    from flint import arb, arb_mat

    def ball(of: Intervals, place: tuple[int, int]) -> "arb":
        return arb(float(of.middle[place]), float(of.radius[place]))

    return arb_mat([[ball(*entry) for entry in row] for row in rows])


def _minor(matrix: "arb_mat", count: int) -> "arb":
    """Return a leading minor."""
    from flint import arb_mat

    return arb_mat([[matrix[i, j] for j in range(count)] for i in range(count)]).det()
