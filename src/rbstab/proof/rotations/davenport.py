"""Energies that are a quadratic form of the quaternion: rest states without a search.

U = q'Qq/q'q with a symmetric matrix Q of rational numbers (Davenport). Rest states are the
eigenvectors of Q, their energies its eigenvalues, and the index of one is the number of smaller
eigenvalues. How many of these are different is exact.
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from rbstab.proof.exact.matrices import Rows, rational_matrix
from rbstab.proof.exact.rewriting import quadratic_in
from rbstab.proof.rotations.forms import Form
from rbstab.proof.rotations.states import Family, RestRotation, Rotations

BITS = 256
"""The precision of the balls that enclose eigenvectors."""

MOST_BITS = 1 << 14
"""That up to which it is doubled for eigenvalues that are near each other."""


def matrix_of(form: Form) -> Rows:
    """Return Q of a quadratic form over N."""
    if form.power == 0:
        constant = form.numerator.constant
        assert constant is not None
        return [[constant * (i == j) for j in range(4)] for i in range(4)]
    H = quadratic_in(form.numerator, range(4)).H
    return [[x / 2 for x in row] for row in H]


def eigen_states(Q: Rows) -> Rotations:
    """Return all rest states of U = q'Qq/q'q.

    The eigenvalues are the roots of the characteristic polynomial p. 4 - deg gcd(p, p') of them are
    different, each of which python-flint encloses with its multiplicity. Where one is simple, each
    column of the product of Q - μI for all others μ is a multiple of the eigenvector.
    """
    from flint import ctx

    bits = BITS
    while bits <= MOST_BITS:
        with ctx.workprec(bits):
            rotations = _states(Q)
        if rotations is not None:
            return rotations
        bits *= 2
    return Rotations((), 0, "two eigenvalues are too near each other")


def _states(Q: Rows) -> Rotations | None:
    """Return the rest states; None if more bits are needed."""
    p = rational_matrix(Q).charpoly()
    different = 4 - p.gcd(p.derivative()).degree()
    enclosed: Any = p.numer().complex_roots()
    roots = sorted(
        ((root.real, count) for root, count in enclosed),
        key=lambda pair: float(pair[0].mid()),
    )
    separate = all(a < b for (a, _), (b, _) in pairwise(roots))
    if not separate or len(roots) != different:
        return None
    states, families, below = list[RestRotation](), list[Family](), 0
    for value, count in roots:
        if count > 1:
            families.append(Family(*_ends(value), below, count - 1))
        else:
            others = [other for other, _ in roots if other is not value]
            state = _state(Q, value, others, below)
            if state is None:
                return None
            states.append(state)
        below += count
    return Rotations(tuple(states), 0, families=tuple(families))


def _state(Q: Rows, value: Any, others: Sequence[Any], index: int) -> RestRotation | None:
    """Return the rest state of a simple eigenvalue; None if more bits are needed."""
    from flint import arb, arb_mat

    M, P = arb_mat(rational_matrix(Q)), arb_mat(4, 4, 1)
    for other in others:
        P = P * (M - arb_mat(4, 4, 1) * other)
    k = max(range(4), key=lambda k: abs(float(P[k, k].mid())))
    column = [P[j, k] for j in range(4)]
    norm = sum((x * x for x in column), arb(0)).sqrt()
    if not norm > 0:
        return None
    unit = [x / norm for x in column]
    q = np.array([float(x.mid()) for x in unit])
    spread = sum((abs(x - arb(float(y))) for x, y in zip(unit, q, strict=True)), arb(0))
    radius = float(np.nextafter(float(spread.upper()), np.inf))
    return None if not radius < 1e-9 else RestRotation(q, radius, index, *_ends(value))


def _ends(value: Any) -> tuple[float, float]:
    """Return doubles below and above a ball."""
    low, high = float(value.lower()), float(value.upper())
    return float(np.nextafter(low, -np.inf)), float(np.nextafter(high, np.inf))
