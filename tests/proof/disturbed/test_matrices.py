"""Protects that matrices are called positive definite only if they are, for all Θ of a box."""

from fractions import Fraction
from itertools import product

import numpy as np
import pytest
from support.disturbed import forms_of_config, tied_config

from rbstab.proof.boxes import Boxes
from rbstab.proof.disturbed.matrices import Family, Matrices, definite
from rbstab.proof.exact.expr import expr, variables
from rbstab.proof.exact.matrices import inverse_of_definite


def is_definite(M):
    return inverse_of_definite([[Fraction(x) for x in row] for row in M.tolist()]) is not None


def nearly_singular(rng, n, slack):
    """Return a matrix of integers times powers of 2 with the smallest eigenvalue near `slack`."""
    A = rng.integers(-9, 10, size=(n, n - 1)).astype(float)
    scales = 2.0 ** rng.integers(-12, 13, size=n)
    return (A @ A.T + slack * np.eye(n)) * np.outer(scales, scales)


@pytest.mark.parametrize("n", [2, 4, 7, 13])
def test_no_matrix_is_called_definite_that_exact_numbers_refute(n):
    rng = np.random.default_rng(n)
    slacks = [0.0, 2.0**-52, -(2.0**-52), 2.0**-45, -(2.0**-40), 2.0**-30, 2.0**-6]
    cases = [nearly_singular(rng, n, slack) for slack in slacks for _ in range(20)]
    positive = definite(np.stack(cases, 2), np.zeros((n, len(cases))))
    truth = np.array([is_definite(M) for M in cases])
    assert not np.any(positive & ~truth)
    assert positive[-20:].all()


def test_what_is_lost_counts():
    M = np.stack([np.eye(4)] * 3, 2)
    lost = np.array([[0.0, 0.999, 1.0]] * 4)
    assert definite(M, lost).tolist() == [True, True, False]
    column = np.zeros((4, 1))
    column[2] = 1.0
    assert not definite(M[..., :1], column).any()


def test_errors_of_entries_count():
    """All matrices I + R with |R_ij| <= r are definite if and only if r < 1/n."""
    n = 5
    middle, slopes = np.eye(n)[..., None], np.zeros((3, n, n, 1))
    for r, expected in ((0.19, True), (0.2, False)):
        error = np.full((n, n, 1), r)
        assert Family(middle, slopes, error).definite().tolist() == [expected]


@pytest.mark.parametrize("signs", list(product((-1.0, 1.0), repeat=3)))
def test_all_corners_count(signs):
    """1 + Σ s_k u_k is positive for all |u_k| <= 1 if and only if Σ |s_k| < 1."""
    for s, expected in (((0.4, 0.3, 0.2), True), ((0.4, 0.3, 0.31), False)):
        slopes = (np.array(s) * signs).reshape(3, 1, 1, 1)
        assert Family(np.ones((1, 1, 1)), slopes, np.zeros((1, 1, 1))).definite() == [expected]


def test_bounds_over_a_box_hold_at_its_points():
    """The entries are those of V and V' at points, which doubles give to round-off."""
    forms = forms_of_config(tied_config("visco-elastic"))
    matrices = Matrices([forms.value(Fraction(2)), forms.decrease(Fraction(2), Fraction(3))])
    rng = np.random.default_rng(0)
    lo = rng.uniform(-1.2, 1.0, size=(3, 40))
    wide = 10.0 ** rng.uniform(-6, -0.5, size=(3, 40))
    families = matrices.over(Boxes(lo, lo + wide))
    for _ in range(20):
        share = rng.choice([-1.0, 1.0, rng.uniform(-1, 1)], size=(3, 40))
        points = lo + 0.5 * wide * (1 + share)
        for family, values in zip(families, matrices.at(points), strict=True):
            affine = family.middle + np.einsum("km,kijm->ijm", share, family.slopes)
            allowed = family.error + 1e-12 * (1 + np.abs(values))
            assert np.all(np.abs(values - affine) <= allowed)


def test_what_has_no_bound_is_not_definite():
    """1/cos θ2 has a pole in the box."""
    M = [[1 / variables(range(3))[1].cos() + expr(9)]]
    (family,) = Matrices([M]).over(Boxes(np.full((3, 1), 1.4), np.full((3, 1), 1.8)))
    assert not family.definite().any()
