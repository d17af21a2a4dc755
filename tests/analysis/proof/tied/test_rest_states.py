"""Protects proofs of tied bodies with springs: no rest state is missed, and regions are right.

Rest states are looked for by SciPy from many starts, with an energy written for these tests.
"""

import numpy as np
import pytest
from scipy.optimize import minimize
from support.held_springs import energy_of as held_energy
from support.held_springs import held_system
from support.pose import attitude
from support.proofs import rest_states
from support.tied_springs import (
    K_D,
    energy_of,
    found_by_scipy,
    slope_of,
    spring_of,
    tied_system,
)

from rbstab.analysis.proof.boxes import Boxes
from rbstab.analysis.proof.certified_region import Face
from rbstab.analysis.proof.outcome import SearchOutcome
from rbstab.analysis.proof.tied.energy import tied_energy_of_doubles
from rbstab.analysis.proof.tied.rest_states import tied_rest_states, unwrapped_tied_states
from rbstab.analysis.proof.tied.search import prove

BENT = spring_of((0.0, 0.0, 0.5), (0.1, 0.05, 1.3), 6000.0, 1.3)
"""It pushes from above, so that the body rests beside it."""

OTHER = spring_of((-0.2, 0.1, 0.0), (-0.6, 0.2, -0.1), 500.0, 0.7)

SMALL = np.array([0.75, 0.75, 0.4])


def places_of(rest):
    """Return [Θ, X] of rest states."""
    motions = [one.point.state.motion for one in rest.states]
    return [np.concatenate([motion.Theta, motion.X]) for motion in motions]


@pytest.mark.parametrize(
    ("springs", "changes"),
    [
        pytest.param([spring_of()], {"soft": 0.2, "K_d": K_D}, marks=pytest.mark.heavy),
        pytest.param([BENT], {"soft": 0.3}, marks=pytest.mark.long),
        pytest.param([spring_of(), OTHER], {"soft": 0.3}, marks=pytest.mark.long),
    ],
    ids=["embedded", "bent", "two"],
)
def test_no_rest_state_that_scipy_finds_is_missed(springs, changes):
    rest = tied_rest_states(tied_energy_of_doubles(tied_system(springs, **changes)))
    assert rest.proved
    places = places_of(rest)
    slope = slope_of(springs, **changes)
    for y in places:
        np.testing.assert_allclose(slope(y), 0.0, atol=1e-3)
    reached = found_by_scipy(springs, np.random.default_rng(0), 40, **changes)
    assert reached
    for y in reached:
        assert min(np.abs(y - other).max() for other in places) < 1e-5
    # Each proved index is the number of negative eigenvalues by differences.
    for y, one in zip(places, rest.states, strict=True):
        moves = 1e-4 * np.eye(6)
        hessian = np.array([(slope(y + h) - slope(y - h)) / 2e-4 for h in moves])
        assert one.point.index_proved
        assert one.point.index == np.sum(np.linalg.eigvalsh(hessian) < 0)


@pytest.mark.heavy
def test_a_spring_that_pushes_makes_several_rest_states():
    """In a part of the range, with all that SciPy finds there."""
    W = tied_energy_of_doubles(tied_system([BENT], 0.3))
    found = prove(W, end=SMALL)
    assert found.outcome is SearchOutcome.PROVED
    reached = found_by_scipy([BENT], np.random.default_rng(1), 25, soft=0.3)
    inside = [y for y in reached if np.all(np.abs(y[:3]) < SMALL)]
    angles = [zero.y[:3] for zero in found.zeros]
    assert len(angles) >= len(inside) > 1
    for y in inside:
        assert min(np.abs(y[:3] - other).max() for other in angles) < 1e-5
    # Starts for Newton's method only save time.
    again = prove(W, [np.concatenate([y[:3], np.zeros(3)]) for y in reached], end=SMALL)
    assert len(again.zeros) == len(found.zeros)


def test_a_very_stiff_tie_holds_the_body():
    """The rest states tend to those of the held body, at a distance of order 1/K_c."""
    springs = [spring_of()]
    held = rest_states(held_system(springs, 1.0))
    assert held.proved
    distances = []
    for stiffness in (1e6, 1e8):
        W = tied_energy_of_doubles(tied_system(springs, 1.0, stiffness * np.eye(3)))
        found = prove(W, end=np.array([0.6, 0.6, 0.6]))
        assert found.outcome is SearchOutcome.PROVED
        assert [zero.index for zero in found.zeros] == [held.states[0].index] == [0]
        distances.append(np.abs(found.zeros[0].y[:3] - held.states[0].Theta).max())
    assert distances[1] < distances[0] / 50 < 1e-4


def border_by_scipy(springs):
    """Return the least energy on θ2 = ±π/2, over X and all other angles."""

    def energy(y, pitch):
        Theta = np.array([y[0], pitch, y[1]])
        return energy_of(springs, Theta, y[2:])

    rng = np.random.default_rng(0)
    starts = [np.concatenate([rng.uniform(-1, 1, 2), 0.1 * rng.normal(size=3)]) for _ in range(6)]
    runs = [minimize(energy, start, (sign * np.pi / 2,)) for start in starts for sign in (-1, 1)]
    return min(float(run.fun) for run in runs)


def without_length_by_scipy(spring):
    """Return the least energy with the point of a spring on its anchor."""

    def energy(Theta):
        return energy_of([spring], Theta, spring.anchor - attitude(Theta) @ spring.point)

    rng = np.random.default_rng(0)
    runs = [minimize(energy, rng.uniform(-1, 1, 3)) for _ in range(8)]
    return min(float(run.fun) for run in runs)


@pytest.mark.heavy
def test_the_region_ends_at_the_border_or_where_a_spring_has_no_length():
    for springs, expected, face in (
        ([spring_of()], border_by_scipy([spring_of()]), True),
        ([near := spring_of(anchor=(0.2, 0.2, 0.4))], without_length_by_scipy(near), False),
    ):
        W = tied_energy_of_doubles(tied_system(springs))
        rest = tied_rest_states(W)
        assert rest.unique
        region, (lowest,) = rest.region, rest.states
        assert region is not None
        assert region.energy_bound is not None
        assert (region.face in {Face.THETA2_LOW, Face.THETA2_HIGH}) == face
        assert (region.line is None) == face
        height = expected - lowest.point.state.energy
        assert region.energy == pytest.approx(expected, abs=1e-5)
        assert expected - 2e-3 * height <= region.energy_bound <= expected + 1e-9
        assert 0.998 * height <= region.lower_bound <= height + 1e-9


def test_a_limit_of_boxes_ends_the_search_undecided():
    W = tied_energy_of_doubles(tied_system([BENT], 0.3))
    with np.errstate(all="ignore"):
        found = prove(W, box_limit=1500)
    assert found.outcome is SearchOutcome.BOX_LIMIT
    assert found.examined >= 1500
    assert len(found.undecided)
    # All rest states that SciPy finds are in these boxes or are known.
    for y in found_by_scipy([BENT], np.random.default_rng(0), 4, soft=0.3):
        point = Boxes(y[None, :3], y[None, :3])
        pairs = zip(found.undecided.low, found.undecided.high, strict=True)
        open_ = [point.within(Boxes(a[None, :3], b[None, :3]))[0] for a, b in pairs]
        known = [np.abs(y[:3] - zero.y[:3]).max() < 1e-5 for zero in found.zeros]
        assert any(open_) or any(known)
    rest = tied_rest_states(W, box_limit=1500)
    assert (rest.proved, rest.region) == (False, None)
    assert rest.unique is not True


def test_the_same_box_is_not_searched_twice():
    """Nothing is at rest beyond a half turn if the stabilizers are stiff enough."""
    stiff, soft = (
        tied_energy_of_doubles(tied_system([spring_of()], factor)) for factor in (50.0, 1.0)
    )
    rest = tied_rest_states(stiff, box_limit=100)
    assert unwrapped_tied_states(stiff, rest) is rest
    wide = unwrapped_tied_states(soft, rest, box_limit=100)
    assert wide is not None
    assert wide is not rest
    assert np.all(wide.end >= rest.end)
    assert np.any(wide.end > rest.end)


def test_held_energies_agree_where_the_tie_is_not_stretched():
    """Both independent energies of these tests are the same where E = 0."""
    Theta = np.array([0.3, -0.4, 0.2])
    X = np.array([0.15, 0.10, -0.42]) - attitude(Theta) @ np.array([0.15, 0.10, -0.42])
    springs = [spring_of()]
    assert energy_of(springs, Theta, X, soft=0.5) == pytest.approx(held_energy(springs, Theta, 0.5))
