"""Branch and bound proves the number of rest states, or reports that it is undecided."""

from dataclasses import replace
from typing import Any

import mpmath
import numpy as np
import pytest
from scipy.optimize import root
from support.rest import inverted_pendulum, paper_system, random_rest_system
from support.systems import VARIANTS

from rbstab.analysis.configuration import configurations
from rbstab.analysis.proof.boxes import RANGE_END, box_around, hulls
from rbstab.analysis.proof.branch_and_bound import MIN_RADIUS, SearchOutcome, prove
from rbstab.analysis.proof.reduced_energy import reduced_energy
from rbstab.analysis.proof.searches.zeros import search
from rbstab.analysis.proof.trigonometric import TrigonometricForm
from rbstab.analysis.proof.zero import isolated_zero

TIED = [variant for variant in VARIANTS if variant != "free"]

NO_WAVES = np.zeros((1, 1, 1))


def assert_the_same_points(one, two, tolerance=1e-9):
    one, two = np.reshape(one, (-1, 3)), np.reshape(two, (-1, 3))
    assert len(one) == len(two)
    apart = np.abs(one[:, None] - two[None]).max(axis=2)
    assert np.all(apart.min(axis=1, initial=np.inf) < tolerance)
    assert np.all(apart.min(axis=0, initial=np.inf) < tolerance)


def thetas(zeros):
    return [zero.Theta for zero in zeros.inside]


# Known numbers of rest states of the permanent and the visco-elastic variant.
COUNTS = [
    ("permanent", 1.0, 1),
    ("permanent", 0.3, 2),
    ("permanent", 0.1, 3),
    ("permanent", 0.03, 4),
    ("permanent", 0.01, 4),
    ("visco-elastic", 1.0, 1),
    ("visco-elastic", 0.3, 1),
    ("visco-elastic", 0.1, 3),
    ("visco-elastic", 0.03, 3),
    ("visco-elastic", 0.01, 4),
]


@pytest.mark.parametrize(("variant", "K_r_scale", "count"), COUNTS)
def test_paper_bodies_have_as_many_rest_states_as_stated(variant, K_r_scale, count):
    zeros = prove(reduced_energy(paper_system(variant, K_r_scale)).form)
    assert zeros.outcome is SearchOutcome.PROVED
    assert len(zeros.inside) == count
    assert len(zeros.undecided) == 0


@pytest.mark.parametrize("K_r_scale", [1.0, 0.01])
def test_free_body_has_one_rest_state(K_r_scale):
    zeros = prove(reduced_energy(paper_system("free", K_r_scale)).form)
    assert zeros.outcome is SearchOutcome.PROVED
    np.testing.assert_array_equal(thetas(zeros), [[0, 0, 0]])


def pendulum_zeros(stiffness, moment):
    """Return the roots of kθ = a sin θ in (-π, π), to forty digits."""
    with mpmath.workdps(40):
        k, a = mpmath.mpf(stiffness), mpmath.mpf(moment)
        if k >= a:
            return [0.0]
        # sin θ / θ falls from 1 to 0: one root on each side.
        theta = mpmath.findroot(
            lambda x: mpmath.sin(x) / x - k / a, (mpmath.mpf("1e-15"), mpmath.pi), solver="anderson"
        )
        return [-float(theta), 0.0, float(theta)]


@pytest.mark.parametrize("ratio", [0.02, 0.3, 0.9, 0.999, 1 - 1e-6, 1 + 1e-6, 1.001, 1.1, 5.0])
def test_pendulum_stands_where_its_one_equation_says(ratio):
    zeros = prove(reduced_energy(inverted_pendulum([100 * ratio, 250, 70], 100.0)).form)
    assert zeros.outcome is SearchOutcome.PROVED
    expected = [[theta, 0, 0] for theta in pendulum_zeros(100 * ratio, 100.0)]
    assert_the_same_points(thetas(zeros), expected)


@pytest.mark.parametrize("ratio", [1.0, 1 - 1e-13, 1 + 1e-13, np.nextafter(1.0, 0)])
def test_zeros_about_to_part_are_never_called_proved(ratio):
    zeros = prove(reduced_energy(inverted_pendulum([100 * ratio, 250, 70], 100.0)).form)
    assert zeros.outcome is SearchOutcome.UNDECIDED
    assert len(zeros.inside) == 0
    # The undecided boxes are small, and contain the zeros.
    (hull,) = [(box.low[0], box.high[0]) for box in [hulls(zeros.undecided)]]
    assert np.all(hull[0] < 0)
    assert np.all(hull[1] > 0)
    assert np.all(np.abs(hull) < 1e-4)
    assert np.all(zeros.undecided.radius < MIN_RADIUS)


@pytest.mark.parametrize("gap", [1e-3, 1e-5, 1e-7, 1e-9, 0.0, -1e-9, -1e-7, -1e-5, -1e-3])
def test_fold_is_counted_right_or_not_at_all(gap):
    # ∂U/∂θ1 = ½ - gap - sin θ1 sin... = 1 - cos(θ1 - 1) - gap: two zeros for a gap above 0.
    coefficients = np.zeros((3, 3, 3))
    coefficients[2, 0, 0], coefficients[1, 0, 0] = -np.cos(1.0), np.sin(1.0)
    form = TrigonometricForm(np.diag([0.0, 1, 1]), np.array([1 - gap, 0, 0]), coefficients)
    zeros = prove(form)
    if zeros.outcome is SearchOutcome.PROVED:
        assert gap != 0
        expected: list[list[float]] = []
        if gap > 0:
            half = np.arccos(1 - gap)
            expected = [[1 - half, 0, 0], [1 + half, 0, 0]]
        assert_the_same_points(thetas(zeros), expected, tolerance=1e-6)
    else:
        assert abs(gap) < 1e-6
        assert zeros.outcome is SearchOutcome.UNDECIDED


def test_line_of_zeros_ends_at_the_limit():
    form = reduced_energy(inverted_pendulum([100, 250, 0], 90.0)).form
    zeros = prove(form, box_limit=5000)
    assert zeros.outcome is SearchOutcome.BOX_LIMIT
    assert zeros.inside == ()
    assert 5000 <= zeros.examined < 8000
    (low, high) = hulls(zeros.undecided).low.min(axis=0), hulls(zeros.undecided).high.max(axis=0)
    assert low[2] <= -np.pi
    assert high[2] >= np.pi


@pytest.mark.parametrize("box_limit", [0, 1, 10, 300])
def test_limit_on_boxes_is_an_outcome(box_limit):
    form = reduced_energy(paper_system("permanent", 0.01)).form
    zeros = prove(form, box_limit=box_limit)
    assert zeros.outcome is SearchOutcome.BOX_LIMIT
    # Every zero is proved, or lies in an undecided box.
    left = zeros.undecided
    for Theta in search(form):
        known = any(zero.domain_contains(Theta) for zero in zeros.inside)
        assert known or np.any(np.all((left.low <= Theta) & (Theta <= left.high), axis=1))


def test_known_points_save_time_and_are_not_believed(rng):
    form = reduced_energy(paper_system("visco-elastic", 0.1)).form
    alone = prove(form)
    misled = prove(form, rng.uniform(-3, 3, size=(20, 3)))
    told = prove(form, thetas(alone))
    twice = prove(form, [*thetas(alone), *thetas(alone)])
    for zeros in (misled, told, twice):
        assert zeros.outcome is SearchOutcome.PROVED
        assert_the_same_points(thetas(zeros), thetas(alone))
    assert told.examined <= alone.examined


def with_small_domain(monkeypatch, shrink):
    """Replace the domain of the first isolated zero by `shrink` of that zero."""
    first: list[Any] = []

    def narrowed(form, Theta):
        zero = isolated_zero(form, Theta)
        if zero is None or first:
            return zero
        first.append(zero)
        return replace(zero, domain=shrink(zero))

    monkeypatch.setattr("rbstab.analysis.proof.branch_and_bound.isolated_zero", narrowed)


def test_two_proofs_of_one_zero_count_once(monkeypatch):
    form = reduced_energy(paper_system("permanent")).form
    with_small_domain(monkeypatch, lambda zero: zero.enclosure)
    # The second point lies outside the domain of the first; its own domain contains the first.
    zeros = prove(form, [np.zeros(3), np.full(3, 1e-4)])
    assert len(zeros.inside) == 1


def test_proofs_that_overlap_and_cannot_be_told_apart_leave_it_undecided(monkeypatch):
    form = straight([0.0, 0.0, 0.0])
    with_small_domain(monkeypatch, lambda zero: box_around(zero.Theta, 0.6))
    # The two enclosures of the one zero overlap, but neither lies in the domain of the other.
    zeros = prove(form, [np.full(3, -0.5), np.full(3, 1.5)])
    assert zeros.outcome is SearchOutcome.UNDECIDED
    assert len(zeros.undecided) >= 1


def straight(zero):
    """Return a form whose gradient is Θ minus a point."""
    return TrigonometricForm(np.eye(3), -np.asarray(zero, dtype=float), NO_WAVES)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("sign", [-1, 1])
def test_zero_at_the_border_of_the_range(axis, sign):
    def at(end):
        zero = np.array([0.3, 0.2, 0.1])
        zero[axis] = sign * end
        return prove(straight(zero), [zero])

    end = RANGE_END[axis]
    just_inside, just_outside = at(end * (1 - 1e-10)), at(end * (1 + 1e-10))
    assert just_inside.outcome is just_outside.outcome is SearchOutcome.PROVED
    assert (len(just_inside.inside), len(just_outside.inside)) == (1, 0)
    assert len(just_outside.outside) == 1
    upon = at(np.nextafter(end, 0))
    assert upon.outcome is SearchOutcome.UNDECIDED
    assert upon.inside == upon.outside == ()


def test_zeros_beyond_the_reach_of_the_bounds_are_left_alone():
    zeros = prove(straight([0.0, 0.0, 4.5]), [np.array([0.0, 0.0, 4.5])])
    assert zeros.outcome is SearchOutcome.PROVED
    assert zeros.inside == zeros.outside == ()


def test_wild_landscape_is_mapped(rng):
    # It has dozens of zeros inside the range, and more outside.
    root = rng.normal(size=(3, 3))
    waves = rng.normal(size=(5, 5, 5))
    form = TrigonometricForm(root @ root.T, rng.normal(size=3), waves)
    zeros = prove(form)
    assert zeros.outcome is SearchOutcome.PROVED
    seen = search(form, starts=3000)
    assert len(seen) > 5
    assert_the_same_points(seen, thetas(zeros))
    domains = [zero.domain for zero in (*zeros.inside, *zeros.outside)]
    owners = [sum(bool(zero.enclosure.within(box)[0]) for box in domains) for zero in zeros.inside]
    assert set(owners) == {1}


def zeros_by_another_way(system, rng, starts):
    """Find roots of the gradient of the stored energy in all variables, by SciPy."""
    still = configurations(system)
    found: list[np.ndarray] = []
    for guess in rng.uniform(-RANGE_END, RANGE_END, size=(starts, 3)):
        start = np.concatenate([guess, still.unloaded[3:]])
        ended = root(still.gradient, start, tol=1e-13)
        Theta = ended.x[:3]
        balanced = np.abs(still.gradient(ended.x)).max() < 1e-7
        new = all(np.abs(Theta - other).max() > 1e-5 for other in found)
        if balanced and new and np.all(np.abs(Theta) < RANGE_END):
            found.append(Theta)
    return found


@pytest.mark.parametrize("variant", TIED)
def test_another_search_finds_no_more(variant):
    rng = np.random.default_rng(7)
    system = random_rest_system(rng, variant)
    zeros = prove(reduced_energy(system).form)
    assert zeros.outcome is SearchOutcome.PROVED
    for Theta in zeros_by_another_way(system, rng, 25):
        assert any(zero.domain_contains(Theta) for zero in zeros.inside)


def agree(rng, variant):
    form = reduced_energy(random_rest_system(rng, variant)).form
    zeros = prove(form)
    assert zeros.outcome is SearchOutcome.PROVED
    assert_the_same_points(search(form), thetas(zeros))
    return len(zeros.inside)


@pytest.mark.parametrize("variant", TIED)
def test_proof_and_search_agree_on_random_bodies(rng, variant):
    assert agree(rng, variant) >= 1


@pytest.mark.slow
@pytest.mark.parametrize("variant", VARIANTS)
def test_proof_and_search_agree_on_fifty_random_bodies_of_each_variant(variant):
    rng = np.random.default_rng(2)
    counts = [agree(rng, variant) for _ in range(50)]
    assert variant == "free" or max(counts) > 3
