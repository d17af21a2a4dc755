"""All zeros of functions whose zeros have a closed form, their indices, borders and families."""

from dataclasses import replace
from fractions import Fraction
from math import comb
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq

from rbstab.proof import search
from rbstab.proof.boxes import Box, Boxes
from rbstab.proof.enclosures.bounds import BoundedEnergy
from rbstab.proof.exact.expr import expr, variable
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


def same_points(found, expected, tolerance=1e-9):
    """Each zero is one of the expected points, its enclosure contains it, and none is missing."""
    left = [np.array(point, dtype=float) for point in expected]
    assert len(found.zeros) == len(left)
    for zero in found.zeros:
        (k,) = (k for k, x in enumerate(left) if np.abs(x - zero.point).max() < tolerance)
        x = left.pop(k)
        assert np.all(zero.enclosure.lo <= x + 1e-14)
        assert np.all(x - 1e-14 <= zero.enclosure.hi)
        assert np.all(zero.domain.lo <= zero.enclosure.lo)
        assert np.all(zero.enclosure.hi <= zero.domain.hi)
    for zero in found.zeros:
        assert sum(zero.domain.contains(other.point) for other in found.zeros) == 1


def test_a_product_of_wells_has_all_indices():
    """U = Σ (θ_i² - a_i²)²/4: 27 zeros at 0 and ±a_i; the index counts the zeros at 0."""
    a = (Fraction(1), Fraction(1, 2), Fraction(3, 2))
    U = sum(
        ((v * v - s * s) ** 2 * Fraction(1, 4) for v, s in zip((X, Y, Z), a, strict=True)), expr(0)
    )
    found = proved(U)
    assert found.proved
    places = [(-float(s), 0.0, float(s)) for s in a]
    same_points(found, [(x, y, z) for x in places[0] for y in places[1] for z in places[2]])
    for k in range(4):
        assert sum(zero.index == k for zero in found.zeros) == comb(3, k) * 2 ** (3 - k)
    for zero in found.zeros:
        assert zero.index == int(np.sum(np.abs(zero.point) < 0.1))
        exact = 0.25 * sum((v * v - float(s) ** 2) ** 2 for v, s in zip(zero.point, a, strict=True))
        assert zero.energy == pytest.approx(exact, abs=1e-12)
    energies = [zero.energy for zero in found.zeros]
    assert energies == sorted(energies)


def test_a_product_of_sines_has_its_lattice_of_zeros():
    """sin θ1 sin θ2 with ½ θ3², in [-2, 2]² × [-1, 1]: ±π/2 each, and the saddle at 0."""
    found = proved(X.sin() * Y.sin() + HALF * Z * Z, cube([2.0, 2.0, 1.0]))
    assert found.proved
    q = np.pi / 2
    expected = [(0, 0, 0), *((a * q, b * q, 0) for a in (-1, 1) for b in (-1, 1))]
    same_points(found, expected)
    for zero in found.zeros:
        x, y, _ = zero.point
        saddle = abs(x) < 1e-9
        assert zero.index == (1 if saddle else 2 if x * y > 0 else 0)


@pytest.mark.parametrize("ratio", [0.02, 0.3, 0.9, 0.999, 1 - 1e-6, 1 + 1e-6, 1.001, 5.0])
def test_a_pendulum_stands_where_its_one_equation_says(ratio):
    """kθ = sin θ: three zeros for k < 1 in (-π, π), else one."""
    k = Fraction(str(ratio))
    found = proved(X.cos() + HALF * (k * X * X + Y * Y + Z * Z))
    assert found.proved
    expected = [(0.0, 0, 0)]
    if ratio < 1:
        root = brentq(lambda x: np.sin(x) / x - ratio, 1e-9, np.pi, xtol=1e-15, rtol=1e-15)
        expected += [(root, 0, 0), (-root, 0, 0)]
    if abs(ratio - 1) > 1e-5:  # else the root itself is known to less
        same_points(found, expected)
    assert len(found.zeros) == len(expected)
    assert {zero.index for zero in found.zeros} == ({0, 1} if ratio < 1 else {0})


@pytest.mark.parametrize("k", [Fraction(1), 1 - Fraction(1, 10**13), 1 + Fraction(1, 10**13)])
def test_zeros_about_to_part_are_never_called_proved(k):
    found = proved(X.cos() + HALF * (k * X * X + Y * Y + Z * Z))
    assert not found.proved
    assert found.zeros == ()
    low, high = found.undecided.lo.min(axis=1), found.undecided.hi.max(axis=1)
    assert np.all(low < 0)
    assert np.all(high > 0)
    assert np.all(np.abs([low, high]) < 1e-3)
    assert 0.999 < found.share <= 1.0


@pytest.mark.parametrize("gap", ["1e-3", "1e-5", "1e-7", "1e-9", "0", "-1e-9", "-1e-5", "-1e-3"])
def test_a_fold_is_counted_right_or_not_at_all(gap):
    """∂U/∂θ1 = 1 - gap - cos(θ1 - 1): two zeros for a gap above 0, none below."""
    c = Fraction(gap)
    found = proved((1 - c) * X - (X - 1).sin() + HALF * (Y * Y + Z * Z))
    if not found.proved:
        assert abs(c) <= Fraction(1, 10**7)
        return
    assert c != 0
    assert len(found.zeros) == (2 if c > 0 else 0)
    if c > Fraction(1, 10**6):
        half = np.arccos(1 - float(c))
        same_points(found, [(1 - half, 0, 0), (1 + half, 0, 0)], 1e-6)


@pytest.mark.parametrize("soft", ["0", "1e-7", "1e-4"])
def test_one_angle_without_stiffness_is_a_family(soft):
    """U = 5 θ1² + 5 θ2² + ½ soft θ3²: without stiffness all (0, 0, θ3) are at rest."""
    c = Fraction(soft)
    found = proved(5 * X * X + 5 * Y * Y + HALF * c * Z * Z)
    assert found.family == (c == 0)
    assert found.proved == (c != 0)
    assert len(found.zeros) == int(c != 0)
    assert found.examined < 5_000
    if c == 0:
        assert len(found.singular) >= search.FAMILY_TRIES
        for x in found.singular:
            np.testing.assert_allclose(x[:2], 0, atol=1e-9)
        assert found.undecided.count > 0
        assert found.undecided.lo[2].min() <= -3
        assert found.undecided.hi[2].max() >= 3


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("sign", [-1, 1])
def test_a_zero_on_the_border_is_undecided(axis, sign):
    """U = ½ |Θ - c|²: c just inside counts, just outside does not, upon it is not known."""
    box = WIDE

    def at(end: Fraction) -> Any:
        centre = [Fraction(3, 10), Fraction(1, 5), Fraction(1, 10)]
        centre[axis] = sign * end
        U = sum((HALF * (v - c) ** 2 for v, c in zip((X, Y, Z), centre, strict=True)), expr(0))
        return proved(U, box)

    end = Fraction(box.hi[axis])
    little = Fraction(1, 10**10)
    inside, outside = at(end * (1 - little)), at(end * (1 + little))
    assert inside.proved
    assert outside.proved
    assert (len(inside.zeros), len(outside.zeros)) == (1, 0)
    for upon in (at(end), at(end * (1 - Fraction(1, 10**16)))):
        assert not upon.proved
        assert upon.zeros == ()
        across = proved_across(upon, box, sign, axis)
        assert len(across) == 1


def proved_across(upon, box, sign, axis):
    """Return the zeros on the border of a search that counts them."""
    centre = np.array([0.3, 0.2, 0.1])
    centre[axis] = sign * box.hi[axis]
    exact = [Fraction(float(c)) for c in centre]
    U = sum((HALF * (v - c) ** 2 for v, c in zip((X, Y, Z), exact, strict=True)), expr(0))
    found = proved(U, box, across=True)
    assert found.proved
    assert upon.undecided.touch(Box(centre - 1e-9, centre + 1e-9)).any()
    return found.zeros


@pytest.mark.parametrize("limit", [0, 1, 10])
def test_a_limit_leaves_every_zero_proved_or_undecided(limit):
    U = sum(((v * v - 1) ** 2 * Fraction(1, 4) for v in (X, Z)), HALF * Y * Y)
    found = proved(U, limit=limit)
    assert not found.proved
    assert found.examined >= limit
    assert 0 <= found.share <= 1
    for x in (-1, 0, 1):
        for z in (-1, 0, 1):
            point = np.array([x, 0.0, z], dtype=float)
            known = any(zero.domain.contains(point) for zero in found.zeros)
            assert known or found.undecided.touch(Box(point, point)).any()


def test_a_zero_is_enclosed_to_round_off_and_alone_in_its_domain():
    """θ = 2 sin θ; the root by iteration, whose slope there is -0.64."""
    root = 1.9
    for _ in range(200):
        root = 2 * np.sin(root)
    energy = BoundedEnergy(2 * X.cos() + HALF * (X * X + 3 * Y * Y + Z * Z))
    zeros = [isolated(energy, np.array([x, 0.0, 0.0])) for x in (-root, 0.0, root)]
    for zero in zeros:
        assert zero is not None
        assert (zero.enclosure.hi - zero.enclosure.lo).max() < 2e-13
        assert sum(zero.domain.contains(other.point) for other in zeros if other) == 1
        assert (zero.domain.hi - zero.domain.lo).max() > 0.1
        assert zero.index == int(zero.point[0] == 0)
    near = isolated(energy, np.array([1e-3, 0, 0]))
    assert near is not None
    assert 1e-3 < near.enclosure.hi[0] - 1e-3 < 2.5e-3
    assert isolated(energy, np.array([0.9, 0.0, 0.0])) is None


def test_newton_says_where_it_does_not_arrive():
    straight = BoundedEnergy(X + Y + Z)
    start = np.array([[0.3], [0.2], [0.1]])
    ends, last = newton(straight, start)
    np.testing.assert_array_equal(ends, start)
    assert not last[0] < 1
    # Along θ1 it arrives, along θ2 there is nothing to arrive at.
    ends, last = newton(BoundedEnergy((X - 1) ** 2 + Y), start)
    np.testing.assert_allclose(ends[:, 0], [1, 0.2, 0.1], atol=1e-15)
    assert not last[0] < 0.1
    ends, last = newton(BoundedEnergy((X - 1) ** 2), start)
    np.testing.assert_allclose(ends[:, 0], [1, 0.2, 0.1], atol=1e-15)
    assert last[0] < 1e-9
    # At 1.05 the slope 1 - 2 cos θ1 is nearly zero: the step would go far, and is cut to 0.5.
    pendulum = BoundedEnergy(2 * X.cos() + HALF * (X * X + Y * Y + Z * Z))
    start = np.array([[1.05], [0.01], [0.0]])
    ends, last = newton(pendulum, start, steps=1)
    assert last[0] > 10
    assert np.abs(ends - start).max() == pytest.approx(0.5, rel=1e-12)


def shrunk(monkeypatch, shrink):
    """Replace the domain of the first zero that is isolated by `shrink` of it."""
    first: list[Any] = []

    def narrowed(energy, point):
        zero = isolated(energy, point)
        if zero is None or first:
            return zero
        first.append(zero)
        return replace(zero, domain=shrink(zero))

    monkeypatch.setattr(search, "isolated", narrowed)


def test_two_proofs_of_one_zero_count_once(monkeypatch):
    """The second point lies outside of the domain of the first, whose enclosure is wider."""
    shrunk(monkeypatch, lambda zero: zero.enclosure)
    run = Search(BoundedEnergy(HALF * (X * X + Y * Y + Z * Z)), cube(1.0))
    first = isolated(run.energy, np.full(3, 1e-4))
    again = isolated(run.energy, np.zeros(3))
    assert first is not None
    assert again is not None
    run._add(replace(first, domain=first.enclosure))
    run._add(again)
    found = run.run(LIMIT)
    assert len(found.zeros) + found.undecided.count == 1


def test_proofs_that_cannot_be_told_apart_leave_it_undecided():
    run = Search(BoundedEnergy(HALF * (X * X + Y * Y + Z * Z)), cube(1.0))
    one, two = (isolated(run.energy, np.full(3, x)) for x in (-0.2, 0.3))
    assert one is not None
    assert two is not None
    run._add(replace(one, domain=Box(np.full(3, -0.45), np.full(3, 0.05))))
    run._add(replace(two, domain=Box(np.full(3, -0.05), np.full(3, 0.65))))
    found = run.run(LIMIT)
    assert not found.proved
    assert found.undecided.count >= 1


def test_known_zeros_are_kept_and_another_reason_ends_boxes():
    """A further test says of all boxes that there is nothing else."""
    energy = BoundedEnergy((X * X - 1) ** 2 * Fraction(1, 4) + HALF * (Y * Y + Z * Z))
    left = isolated(energy, np.array([-1.0, 0, 0]))
    assert left is not None
    found = Search(energy, WIDE, known=[left], also=lambda b, _: b.lo[0] > -9).run(LIMIT)
    assert found.proved
    assert found.zeros == (left,)
    assert found.examined == 1


def test_starts_save_boxes_and_are_not_believed():
    """From zeros themselves, from random points, and from the same points twice."""
    energy = BoundedEnergy((X * X - 1) ** 2 * Fraction(1, 4) + HALF * (Y * Y + Z * Z))
    alone = Search(energy, WIDE).run(LIMIT)
    places = np.array([zero.point for zero in alone.zeros]).T
    random = np.random.default_rng(0).uniform(-1.5, 1.5, (3, 20))
    for starts in (places, random, np.concatenate([places, places], 1)):
        found = Search(energy, WIDE).run(LIMIT, starts)
        assert found.proved
        same_points(found, [(x, 0, 0) for x in (-1, 0, 1)])
        assert found.examined <= alone.examined


def test_zeros_may_be_added_after_a_search_that_ended_early():
    energy = BoundedEnergy((X * X - 1) ** 2 * Fraction(1, 4) + HALF * (Y * Y + Z * Z))
    run = Search(energy, WIDE)
    first = run.run(0)
    assert (first.zeros, first.undecided.count) == ((), 1)
    more = run.with_zeros_near(np.array([[0.9, -1.1], [0.1, 0.0], [0.0, 0.1]]))
    assert len(more.zeros) == 2
    assert not more.proved


def test_zeros_of_the_least_energy_over_further_variables():
    """min over z of ½ z² - z sin θ1 + ¼ sin² θ1 is -¼ sin² θ1: zeros at multiples of π/2."""
    U = HALF * W * W - W * X.sin() + Fraction(1, 4) * X.sin() ** 2 + HALF * (Y * Y + Z * Z)
    energy = BoundedEnergy(U, free=(3,))
    with np.errstate(all="ignore"):
        found = Search(energy, cube([2.0, 1.0, 1.0])).run(LIMIT)
    assert found.proved
    same_points(found, [(x, 0, 0) for x in (-np.pi / 2, 0, np.pi / 2)])
    assert [zero.index for zero in found.zeros] == [0, 0, 1]


def test_halves_cover_a_box_and_boxes_know_what_they_touch():
    boxes = Boxes(np.array([[0.0, 2.0]] * 2), np.array([[1.0, 4.0]] * 2))
    halves = boxes.halved(np.array([0, 1]))
    np.testing.assert_array_equal(halves.lo, [[0, 2, 0.5, 2], [0, 2, 0, 3]])
    np.testing.assert_array_equal(halves.hi, [[0.5, 4, 1, 4], [1, 3, 1, 4]])
    assert boxes.touch(Box(np.full(2, 1.0), np.full(2, 1.5))).tolist() == [True, False]
    assert boxes.within(Box(np.full(2, 0.0), np.full(2, 1.0))).tolist() == [True, False]


@pytest.mark.parametrize(
    "seed", [pytest.param(s, marks=[pytest.mark.heavy] * (s > 0)) for s in range(6)]
)
def test_a_wild_energy_has_the_zeros_that_many_starts_find(seed):
    """Newton's method of SciPy from 400 points, on the gradient in closed form."""
    from scipy.optimize import root

    rng = np.random.default_rng(seed)
    K = rng.integers(-2, 3, (4, 3))
    c, phase = rng.integers(1, 4, 4), rng.integers(0, 6, 4)
    U = HALF * (X * X + Y * Y + Z * Z)
    for row, factor, shift in zip(K.tolist(), c.tolist(), phase.tolist(), strict=True):
        U = U + factor * HALF * (row[0] * X + row[1] * Y + row[2] * Z + shift).cos()

    def gradient(x):
        return x - 0.5 * K.T @ (c * np.sin(K @ x + phase))

    found = Search(BoundedEnergy(U), cube(2.0)).run(100_000)
    assert found.proved
    seen: list[Any] = []
    for start in rng.uniform(-2, 2, (400, 3)):
        ended = root(gradient, start, tol=1e-13)
        x = ended.x
        fresh = all(np.abs(x - other).max() > 1e-6 for other in seen)
        if ended.success and np.abs(gradient(x)).max() < 1e-10 and np.all(np.abs(x) < 2) and fresh:
            seen.append(x)
            assert any(zero.domain.contains(x) for zero in found.zeros)
    # A proved zero is one, whether a start came there or not.
    for zero in found.zeros:
        assert np.abs(gradient(zero.point)).max() < 1e-10
        H = np.eye(3) - 0.5 * (K.T * (c * np.cos(K @ zero.point + phase))) @ K
        assert zero.index == int(np.sum(np.linalg.eigvalsh(H) < 0))
    assert len(seen) <= len(found.zeros)
