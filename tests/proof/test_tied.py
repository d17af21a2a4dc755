"""Protects proofs of bodies that are not held, with springs: nothing is missed or said too much.

Rest states and least energies are looked for by SciPy, with an energy written for these tests.
"""

import numpy as np
import pytest
from scipy.optimize import minimize
from support.ligaments import ligament_of
from support.pose import attitude
from support.tied_springs import (
    K_D,
    energy_of,
    found_by_scipy,
    slope_of,
    spring_of,
    tied_system,
)

from rbstab.proof.enclosures.tied import TiedBounds
from rbstab.proof.exact.expr import variable
from rbstab.proof.exact.lengths import springs_of, with_lengths_apart, with_squares
from rbstab.proof.reasons import NoReducedEnergy
from rbstab.proof.rest_states import Body
from rbstab.systems.parameters import map_parameters

BENT = spring_of((0.0, 0.0, 0.5), (0.1, 0.05, 1.3), 6000.0, 1.3)
"""It pushes from above, so that the body rests beside it."""

OTHER = spring_of((-0.2, 0.1, 0.0), (-0.6, 0.2, -0.1), 500.0, 0.7)

END = np.array([np.pi, np.pi / 2, np.pi])


def body_of(springs, soft=1.0, *others, **changes):
    """Return the body, with the doubles of its system as exact numbers."""
    system = tied_system(springs, soft, *([changes["K_c"]] if "K_c" in changes else []))
    if "K_d" in changes or others:
        from support.tied_springs import K_C

        system = tied_system(springs, soft, K_C, changes.get("K_d"), *others)
    return Body(system, lambda convert: map_parameters(system, lambda _, x: convert(x)))


def least_by_scipy(springs, Theta, **changes):
    """Return the least energy over X at Θ."""

    def energy(X):
        return energy_of(springs, Theta, X, **changes)

    starts = np.random.default_rng(0).normal(size=(4, 3)) * 0.3
    return min(float(minimize(energy, start, tol=1e-12).fun) for start in starts)


def test_bounds_contain_the_least_energy_over_the_position():
    springs, rng = [spring_of(), OTHER], np.random.default_rng(3)
    body = body_of(springs, 0.4)
    assert isinstance(body.bounded, TiedBounds)
    middle = rng.uniform(-0.9, 0.9, (3, 6)) * END[:, None]
    width = 0.05
    b = body.bounded.over(middle - width, middle + width)
    known = np.isfinite(b.value.lo)
    assert known.sum() > 3
    offset = body.bounded.at(np.zeros((3, 1)))[0][0] - least_by_scipy(
        springs, np.zeros(3), soft=0.4
    )
    for k in np.flatnonzero(known):
        value = least_by_scipy(springs, middle[:, k], soft=0.4) + offset
        assert b.value.lo[k] - 1e-6 <= value <= b.value.hi[k] + 1e-6
        for _ in range(3):
            x = middle[:, k] + rng.uniform(-width, width, 3)
            step = 1e-4
            slope = [
                (
                    least_by_scipy(springs, x + h, soft=0.4)
                    - least_by_scipy(springs, x - h, soft=0.4)
                )
                / (2 * step)
                for h in step * np.eye(3)
            ]
            assert np.all(b.slopes.lo[:, k] - 1e-3 <= slope)
            assert np.all(slope <= b.slopes.hi[:, k] + 1e-3)


def test_where_two_positions_balance_nothing_is_said():
    """A spring that is stiffer than what holds X, near its anchor, has several rest positions."""
    strong = spring_of((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 40_000.0, 1.0)
    body = body_of([strong])
    x = np.zeros((3, 1))
    b = body.bounded.over(x, x)
    assert not np.isfinite(b.value.lo[0])
    slope = slope_of([strong])
    from scipy.optimize import root

    rng = np.random.default_rng(0)
    found = set()
    for start in rng.normal(size=(30, 3)):
        end = root(lambda X: slope(np.concatenate([np.zeros(3), X]))[3:], start)
        if end.success:
            found.add(tuple(np.round(end.x, 3)))
    assert len(found) > 1


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
    rest = body_of(springs, **changes).proved(100_000)
    assert rest.proved
    places = [np.concatenate([one.state.motion.Theta, one.state.motion.X]) for one in rest.states]
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
        assert one.index_proved
        assert one.index == np.sum(np.linalg.eigvalsh(hessian) < 0)


def border_by_scipy(springs):
    """Return the least energy on θ2 = ±π/2, over X and all other angles."""

    def energy(y, pitch):
        return energy_of(springs, np.array([y[0], pitch, y[1]]), y[2:])

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
    near = spring_of(anchor=(0.2, 0.2, 0.4))
    for springs, expected, at_border in (
        ([spring_of()], border_by_scipy([spring_of()]), True),
        ([near], without_length_by_scipy(near), False),
    ):
        body = body_of(springs)
        rest = body.proved(100_000)
        assert rest.unique
        region = body.regions(rest).certified
        assert region is not None
        assert region.energy_bound is not None
        (lowest,) = rest.states
        height = expected - lowest.state.energy
        assert region.spring is not at_border
        assert (region.face is not None) == at_border
        assert region.energy - rest.zeros.zeros[0].energy == pytest.approx(height, abs=1e-4)
        assert 0.999 * height <= region.lower_bound <= height + 1e-6


def test_a_limit_of_boxes_ends_the_search_undecided():
    rest = body_of([BENT], 0.3).proved(300)
    assert not rest.proved
    assert rest.examined >= 300
    assert rest.unique is not True
    left = rest.zeros.undecided
    for y in found_by_scipy([BENT], np.random.default_rng(0), 4, soft=0.3):
        x = y[:3, None]
        open_ = np.all((left.lo <= x + 1e-6) & (x - 1e-6 <= left.hi), axis=0).any()
        known = [np.abs(y[:3] - one.Theta).max() < 1e-5 for one in rest.states]
        assert open_ or any(known)


def test_ligaments_beside_springs_are_part_of_what_is_convex():
    body = body_of([spring_of()], 1.0, ligament_of())
    springs = springs_of(body.energy.U, body.energy.free)
    assert len(springs.lines) == 1
    assert springs.convex.terms
    assert body.bounded.rest is not None


def test_a_spring_is_a_quadratic_part_and_its_length():
    x, y, z = (variable(k) for k in (3, 4, 5))
    r = variable(0).cos()
    length = ((x + r) ** 2 + y**2 + (z - 1) ** 2).sqrt()
    U = 3 * (length - 2) ** 2
    apart = with_squares(with_lengths_apart(U, (3, 4, 5)), (3, 4, 5))
    springs = springs_of(apart + 5 * (x**2 + y**2 + z**2) - 6 * r * x + 6 * z, (3, 4, 5))
    (line,) = springs.lines
    assert line.weight == 12
    assert [str(one) for one in line.offset] == [str(one) for one in (r, 0 * r, 0 * r - 1)]
    assert abs(float(springs.stiffness) - 16) < 1e-6


def test_a_stop_beside_a_spring_is_refused():
    from rbstab.elements.guards.stop import Stop

    with pytest.raises(NoReducedEnergy, match="beside a stop"):
        body_of([spring_of()], 1.0, Stop(name="stop", angle=1.2, restitution=0.0))
