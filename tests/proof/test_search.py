"""All zeros of functions whose zeros have a closed form, their indices, borders and families."""

from dataclasses import replace
from fractions import Fraction
from math import comb
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

from rbstab.proof import search
from rbstab.proof.boxes import Box
from rbstab.proof.enclosures.bounds import BoundedEnergy
from rbstab.proof.exact.expr import expr, variable
from rbstab.proof.model import COSINE
from rbstab.proof.search import Search
from rbstab.proof.zeros import isolated, newton

X, Y, Z, W = (variable(k) for k in range(4))
HALF = Fraction(1, 2)
PI = np.nextafter(np.pi, 4)
WIDE = Box(np.array([-PI, -1.6, -PI]), np.array([PI, 1.6, PI]))
LIMIT = 20_000


def cube(reach):
    """Return the box of all |θ_i| <= reach."""
    end = np.broadcast_to(np.asarray(reach, dtype=float), 3)
    return Box(-end, end)


def proved(U, box=WIDE, limit=LIMIT, **more):
    """Return what a search finds."""
    with np.errstate(all="ignore"):
        return Search(BoundedEnergy(U), box, **more).run(limit)


def same_points(zeros, expected, tolerance=1e-9):
    """Each zero is one of the expected points, its enclosure contains it, and none is missing."""
    left = [np.array(point, dtype=float) for point in expected]
    assert len(zeros.zeros) == len(left)
    for zero in zeros.zeros:
        (k,) = (k for k, x in enumerate(left) if np.abs(x - zero.point).max() < tolerance)
        x = left.pop(k)
        assert np.all(zero.enclosure.lo <= x + 1e-14)
        assert np.all(x - 1e-14 <= zero.enclosure.hi)
        assert np.all(zero.domain.lo <= zero.enclosure.lo)
        assert np.all(zero.enclosure.hi <= zero.domain.hi)
    for zero in zeros.zeros:
        assert sum(zero.domain.contains(other.point) for other in zeros.zeros) == 1


def test_a_product_of_wells_has_all_indices():
    """U = Σ (θ_i² - a_i²)²/4: 27 zeros at 0 and ±a_i; the index counts the zeros at 0."""
    a = (Fraction(1), Fraction(1, 2), Fraction(3, 2))
    U = sum(
        ((v * v - s * s) ** 2 * Fraction(1, 4) for v, s in zip((X, Y, Z), a, strict=True)), expr(0)
    )
    zeros = proved(U)
    assert zeros.proved
    places = [(-float(s), 0.0, float(s)) for s in a]
    same_points(zeros, [(x, y, z) for x in places[0] for y in places[1] for z in places[2]])
    for k in range(4):
        assert sum(zero.index == k for zero in zeros.zeros) == comb(3, k) * 2 ** (3 - k)
    for zero in zeros.zeros:
        assert zero.index == int(np.sum(np.abs(zero.point) < 0.1))
        exact = 0.25 * sum((v * v - float(s) ** 2) ** 2 for v, s in zip(zero.point, a, strict=True))
        assert zero.energy == pytest.approx(exact, abs=1e-12)
        assert (zero.enclosure.hi - zero.enclosure.lo).max() < 1e-12
    energies = [zero.energy for zero in zeros.zeros]
    assert energies == sorted(energies)


@pytest.mark.parametrize("ratio", ["0.02", "0.9", "0.999999", "1", "1.00000000000001", "5"])
def test_a_pendulum_stands_where_its_one_equation_says(ratio):
    """kθ = sin θ: three zeros for k < 1 in (-π, π), else one; about to part they are not proved."""
    k, ratio = Fraction(ratio), float(ratio)
    zeros = proved(X.cos() + HALF * (k * X * X + Y * Y + Z * Z))
    if abs(ratio - 1) < 1e-12:
        assert not zeros.proved
        assert zeros.zeros == ()
        assert zeros.undecided.touch(cube(0.0)).any()
        assert 0.999 < zeros.share <= 1.0
        return
    assert zeros.proved
    expected = [(0.0, 0, 0)]
    if ratio < 1:
        root = brentq(lambda x: np.sin(x) / x - ratio, 1e-9, np.pi, xtol=1e-15, rtol=1e-15)
        expected += [(root, 0, 0), (-root, 0, 0)]
    if abs(ratio - 1) > 1e-5:  # else the root itself is known to less
        same_points(zeros, expected)
    assert len(zeros.zeros) == len(expected)
    assert {zero.index for zero in zeros.zeros} == ({0, 1} if ratio < 1 else {0})


@pytest.mark.parametrize("soft", ["0", "1e-7"])
def test_one_angle_without_stiffness_is_a_family(soft):
    """U = 5 θ1² + 5 θ2² + ½ soft θ3²: without stiffness all (0, 0, θ3) are at rest."""
    c = Fraction(soft)
    zeros = proved(5 * X * X + 5 * Y * Y + HALF * c * Z * Z)
    assert zeros.family == (c == 0)
    assert zeros.proved == (c != 0)
    assert len(zeros.zeros) == int(c != 0)
    assert zeros.examined < 5_000
    if c == 0:
        assert len(zeros.singular) >= search.FAMILY_TRIES
        for x in zeros.singular:
            np.testing.assert_allclose(x[:2], 0, atol=1e-9)
        assert zeros.undecided.count > 0
        assert zeros.undecided.lo[2].min() <= -3
        assert zeros.undecided.hi[2].max() >= 3


@pytest.mark.parametrize(("axis", "sign"), [(0, -1), (1, 1), (2, 1)])
def test_a_zero_on_the_border_is_undecided(axis, sign):
    """U = ½ |Θ - c|²: c just inside counts, just outside does not, upon it is not known."""
    box = WIDE

    def at(end: Fraction, **more: Any) -> Any:
        centre = [Fraction(3, 10), Fraction(1, 5), Fraction(1, 10)]
        centre[axis] = sign * end
        U = sum((HALF * (v - c) ** 2 for v, c in zip((X, Y, Z), centre, strict=True)), expr(0))
        return proved(U, box, **more)

    end = Fraction(box.hi[axis])
    little = Fraction(1, 10**10)
    inside, outside = at(end * (1 - little)), at(end * (1 + little))
    assert inside.proved
    assert outside.proved
    assert (len(inside.zeros), len(outside.zeros)) == (1, 0)
    for upon in (at(end), at(end * (1 - Fraction(1, 10**16)))):
        assert not upon.proved
        assert upon.zeros == ()
        (across,) = at(end, across=True).zeros
        assert upon.undecided.touch(across.enclosure).any()


@pytest.mark.parametrize("limit", [0, 1, 10])
def test_a_limit_leaves_every_zero_proved_or_undecided(limit):
    U = sum(((v * v - 1) ** 2 * Fraction(1, 4) for v in (X, Z)), HALF * Y * Y)
    zeros = proved(U, limit=limit)
    assert not zeros.proved
    assert zeros.examined >= limit
    assert 0 <= zeros.share <= 1
    for x in (-1, 0, 1):
        for z in (-1, 0, 1):
            point = np.array([x, 0.0, z], dtype=float)
            listed = any(zero.domain.contains(point) for zero in zeros.zeros)
            assert listed or zeros.undecided.touch(Box(point, point)).any()


def test_newton_says_where_it_does_not_arrive():
    straight = BoundedEnergy(X + Y + Z)
    start = np.array([[0.3], [0.2], [0.1]])
    ends, last = newton(straight, start)
    np.testing.assert_array_equal(ends, start)
    assert not last[0] < 1
    # Along θ1 it arrives, along θ2 there is nothing to arrive at.
    for more, arrives in ((Y, False), (0 * Y, True)):
        ends, last = newton(BoundedEnergy((X - 1) ** 2 + more), start)
        np.testing.assert_allclose(ends[:, 0], [1, 0.2, 0.1], atol=1e-15)
        assert (last[0] < 1e-9) == arrives
    # At 1.05 the slope 1 - 2 cos θ1 is nearly zero: the step would go far, and is cut to 0.5.
    pendulum = BoundedEnergy(2 * X.cos() + HALF * (X * X + Y * Y + Z * Z))
    start = np.array([[1.05], [0.01], [0.0]])
    ends, last = newton(pendulum, start, steps=1)
    assert last[0] > 10
    assert np.abs(ends - start).max() == pytest.approx(0.5, rel=1e-12)


def test_proofs_that_cannot_be_told_apart_leave_it_undecided():
    run = Search(BoundedEnergy(HALF * (X * X + Y * Y + Z * Z)), cube(1.0))
    first, second = (isolated(run.energy, np.full(3, x)) for x in (-0.2, 0.3))
    assert first is not None
    assert second is not None
    run._add(replace(first, domain=Box(np.full(3, -0.45), np.full(3, 0.05))))
    run._add(replace(second, domain=Box(np.full(3, -0.05), np.full(3, 0.65))))
    zeros = run.run(LIMIT)
    assert not zeros.proved
    assert zeros.undecided.count >= 1


def test_zeros_of_the_least_energy_over_further_variables():
    """min over z of ½ z² - z sin θ1 + ¼ sin² θ1 is -¼ sin² θ1: zeros at multiples of π/2."""
    U = HALF * W * W - W * X.sin() + Fraction(1, 4) * X.sin() ** 2 + HALF * (Y * Y + Z * Z)
    energy = BoundedEnergy(U, free=(3,))
    with np.errstate(all="ignore"):
        zeros = Search(energy, cube([2.0, 1.0, 1.0])).run(LIMIT)
    assert zeros.proved
    same_points(zeros, [(x, 0, 0) for x in (-np.pi / 2, 0, np.pi / 2)])
    assert [zero.index for zero in zeros.zeros] == [0, 0, 1]


def test_a_zero_on_the_end_of_the_pitch_stays_undecided():
    """It is not hidden by a zero beyond it, where cos θ2 >= 0 is wrong."""
    U = -15 * X.cos() * Y.cos() - 25 * X.cos() * Z.cos() - 20 * Y.cos() * Z.cos()
    U = U + 25 * X.sin() * Y.sin() * Z.sin()
    corner = -np.full(3, np.nextafter(np.pi / 2, 4))  # ∇U is zero at θ1 = θ2 = θ3 = -π/2
    box = Box(corner - np.array([0.3, 0.0, 0.3]), corner + 0.2)
    zeros = Search(BoundedEnergy(U, least={COSINE: 0.0}), box).run(5000)
    assert not zeros.proved
    assert zeros.undecided.touch(Box(corner - 1e-9, corner + 1e-9)).any()
