"""Energies U(θ1, p) in closed form: bounds over intervals of p, branches, folds and crossings."""

import numpy as np
import pytest

from rbstab.proof.along.branches import Branches
from rbstab.proof.along.energy import AlongEnergy, OverInterval, parameter_between
from rbstab.proof.along.intervals import intervals_of, proved_over
from rbstab.proof.exact.atoms import VAR
from rbstab.proof.exact.expr import atom, variable
from rbstab.proof.exact.rewriting import substituted
from rbstab.proof.model import Energy
from rbstab.proof.reasons import NoReducedEnergy
from rbstab.proof.robust.numbers import FIRST

X, Y, Z, P, FREE = (variable(k) for k in (0, 1, 2, FIRST, 3))

BESIDE = (Y**2 + Z**2) / 2
"""It holds θ2 and θ3 at zero."""


def along(U, low, high, free=()):
    given = {atom(VAR, FIRST): parameter_between(low, high)}
    return AlongEnergy(Energy(substituted(U + BESIDE, given), free), low, high)


def searched(U, low, high, values=5):
    branches = Branches(along(U, low, high))
    for value in np.linspace(low, high, values):
        branches.search(float(value))
    return branches, intervals_of(branches, lambda: False)


def kinds(branches):
    turns = branches.turns.values()
    return sorted(
        (turn.kind, round(turn.value, 6), round(turn.orientation[0], 6)) for turn in turns
    )


def counts(intervals):
    """Return the counts without repetition, and whether most of all values are proved."""
    rows = [(interval.states, interval.stable) for interval in intervals]
    width = intervals[-1].high - intervals[0].low
    proved = sum(interval.high - interval.low for interval in intervals if interval.proved)
    return [
        row for k, row in enumerate(rows) if k == 0 or row != rows[k - 1]
    ], proved / width > 0.95


def test_bounds_over_an_interval_hold_for_each_parameter_of_it():
    U = (X + P * Y).sin() * P + P**3 * X * Z + X**2
    whole = along(U, -0.5, 1)
    rng = np.random.default_rng(1)
    for _ in range(30):
        low, high = np.sort(rng.uniform(-0.5, 1, 2))
        m, r = rng.uniform(-1, 1, (3, 1)), rng.uniform(0, 0.3, (3, 1))
        b = OverInterval(whole, low, high).over(m - r, m + r)
        for p in (low, high, rng.uniform(low, high)):
            x = m + r * rng.uniform(-1, 1, (3, 1))
            _, g, H = (part[..., 0] for part in whole.at(np.vstack([x, [[p - 0.25]]])))
            at_m = whole.at(np.vstack([b.centre, [[p - 0.25]]]))
            inside = (b.gradient.lo - 1e-9 <= at_m[1][:3]) & (at_m[1][:3] <= b.gradient.hi + 1e-9)
            assert inside.all()
            assert b.value.lo[0] - 1e-9 <= at_m[0][0] <= b.value.hi[0] + 1e-9
            slopes = b.slopes
            assert (slopes.lo[:, 0] - 1e-9 <= g[:3]).all()
            assert (g[:3] <= slopes.hi[:, 0] + 1e-9).all()
            assert (np.abs(H[:3, :3] - b.hessian.mid[..., 0]) <= b.hessian.rad[..., 0] + 1e-9).all()


def test_two_rest_states_meet_at_a_fold():
    """∂U/∂x = x² - (p - 1)."""
    branches, intervals = searched(X**3 / 3 - (P - 1) * X, 0, 2)
    assert kinds(branches) == [("fold", 1, 0)]
    assert counts(intervals) == ([(0, 0), (2, 1)], True)


def test_a_pitchfork_is_symmetric_and_a_crossing_is_not():
    """∂U/∂x = x³ - (p - 1) x, and x² - (p - 1) x."""
    branches, intervals = searched(X**4 / 4 - (P - 1) * X**2 / 2, 0, 2)
    assert kinds(branches) == [("pitchfork", 1, 0)]
    assert counts(intervals) == ([(1, 1), (3, 2)], True)
    branches, intervals = searched(X**3 / 3 - (P - 1) * X**2 / 2, 0, 2.2)
    assert kinds(branches) == [("crossing", 1, 0)]
    assert counts(intervals) == ([(2, 1)], True)


@pytest.mark.parametrize("near", [1e-4, 1e-6, 1e-8])
def test_so_near_a_pitchfork_that_branches_lie_side_by_side_no_count_is_wrong(near):
    """∂U/∂x = x³ - (p - 1) x: one rest state below p = 1, and three above."""
    branches, intervals = searched(X**4 / 4 - (P - 1) * X**2 / 2, 1 - near, 1 + 1.1 * near)
    decided = [one for one in intervals if one.states is not None]
    for one in decided:
        below = 0.5 * (one.low + one.high) < 1
        assert (one.states, one.stable, one.degree) == ((1, 1, 1) if below else (3, 2, 1))
    assert sum(one.high - one.low for one in decided) > 1.5 * near
    assert kinds(branches) == [("pitchfork", 1, 0)]


def test_what_branches_show_is_not_told_where_its_degree_is_that_of_no_proved_interval(monkeypatch):
    """The curve of x = 0 is lost, so that two minima have no saddle between them."""
    branches, _ = searched(X**4 / 4 - (P - 1) * X**2 / 2, 0, 2)
    branches.curves = [one for one in branches.curves if np.ptp(one.orientations[:, 0]) > 0]
    monkeypatch.setattr(Branches, "search", lambda *_: None)
    intervals = intervals_of(branches, lambda: False)
    seen = [one for one in intervals if not one.proved]
    assert {(one.states, one.degree) for one in seen} == {(None, None)}
    assert any(one.proved and one.states == 3 for one in intervals)


def test_rest_states_that_are_not_told_apart_are_not_counted(monkeypatch):
    branches, _ = searched(X**2 / 2 - P * X, 0, 1)
    branches.curves *= 2
    monkeypatch.setattr(Branches, "search", lambda *_: None)
    assert {one.states for one in intervals_of(branches, lambda: True)} == {None}


def test_a_closed_branch_is_followed_once():
    """∂U/∂x = x² + (p - 1)² - 1/4: a circle, with a fold at each end."""
    branches, intervals = searched(X**3 / 3 + X * ((P - 1) ** 2 - 1 / 4), 0, 2)
    assert len(branches.curves) == 1
    assert kinds(branches) == [("fold", 0.5, 0), ("fold", 1.5, 0)]
    assert counts(intervals) == ([(0, 0), (2, 1), (0, 0)], True)


def test_a_branch_ends_where_it_leaves_the_range():
    """x = 3 p."""
    branches, intervals = searched(X**2 / 2 - 3 * P * X, 0.5, 2)
    assert not branches.turns
    assert counts(intervals) == ([(1, 1), (0, 0)], True)
    ends = [interval.low for interval in intervals if not interval.states]
    assert min(ends) == pytest.approx(np.pi / 3, abs=1e-3)


@pytest.mark.parametrize(("low", "high"), [(0.999, 1.001), (0.9, 1.0), (1.0, 1.1), (0, 2)])
def test_nothing_is_proved_about_a_turn(low, high):
    for U in (X**3 / 3 - (P - 1) * X, X**4 / 4 - (P - 1) * X**2 / 2):
        assert proved_over(along(U, 0, 2), low, high, []) is None


def test_variables_that_are_left_need_a_stiffness_that_is_definite_for_all_parameters():
    # Least over z, U is (1/2 - 1/(4 p)) x², and unstable for p < 1/2.
    for low, high, stable in ((1, 1.2, 1), (0.3, 0.32, 0)):
        energy = along(X**2 / 2 + P * FREE**2 + X * FREE, low, high, (3,))
        assert proved_over(energy, low, high, []) == (low, high, 1, stable, True, 2 * stable - 1)
    wrong = [P * FREE**2, P**2 * FREE**2]
    # These are zero at both ends, or hide in a term that is linear in z.
    wrong += [FREE**2 + e for e in (P * FREE**4, (P + 1) * (P - 2) * FREE.cos(), FREE * FREE.cos())]
    wrong += [FREE**2 + e for e in (X**2 * FREE**2, P * X * FREE**2, P * FREE**2 / X)]
    for U in wrong:
        with pytest.raises(NoReducedEnergy, match="not a quadratic function"):
            along(U, -1, 2, (3,))
