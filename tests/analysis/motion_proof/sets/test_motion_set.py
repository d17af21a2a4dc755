"""Sets of states: their halves, and the bounds of energies and angles."""

from dataclasses import replace
from functools import partial
from itertools import product

import numpy as np
import pytest
from flint import arb, ctx
from support.polynomial_sets import BITS, place_in_frame, state_of, value_at
from support.start_sets import VARIANTS, random_config, random_set, together

from rbstab.analysis.exact import decimal_balls
from rbstab.analysis.motion_proof.motion import proof_precision
from rbstab.analysis.motion_proof.sets.equations import equations_of
from rbstab.analysis.motion_proof.sets.monomials import Monomials
from rbstab.analysis.motion_proof.sets.motion_set import MotionSet, _bounds
from rbstab.experiment.convergence.enclosed_system import enclosed_system


def points(rng, states, count):
    """Yield z and w: corners, and random ones."""
    variables, (radius,) = states.space.variables, states.radius
    n = len(radius)
    for _ in range(count):
        yield rng.choice([-1.0, 1.0], variables), rng.choice([-1.0, 1.0], n) * radius
        yield rng.uniform(-1, 1, variables), rng.uniform(-1, 1, n) * radius


@pytest.mark.parametrize("error", [0.0, 1e-7])
def test_halves_cover_the_whole(rng, error):
    """Each point of the set is in the half of its z, at twice the distance from its middle."""
    states, _ = random_set(random_config("free", "Z"), error=error, width=0.3, variables=3)
    for variable in range(3):
        halves = states.halves(variable)
        for (z, w), side in product(points(rng, states, 2), (-1, 1)):
            moved = z.copy()
            moved[variable] = 2 * abs(z[variable]) - 1
            z[variable] = (moved[variable] + side) / 2
            y = state_of(states, z.tolist(), w.tolist())
            half = halves[(side + 1) // 2]
            place = place_in_frame(half, moved.tolist(), y)
            assert np.all(np.abs(place) <= half.radius[0] * (1 + 1e-13))
        assert np.all(halves[0].radius < error + 1e-13)


def test_rounding_of_halves_is_in_the_radius(rng):
    states, _ = random_set(random_config("free", "Z"), error=0.0, width=0.3)
    lower, upper = states.halves(1)
    worst = 0.0
    for half, side in ((lower, -1), (upper, 1)):
        for _ in range(10):
            z = rng.choice([-1.0, 1.0], 2)
            old = [z[0], (z[1] + side) / 2]
            y = state_of(states, old, np.zeros(12))
            place = np.abs(place_in_frame(half, z.tolist(), y))
            assert np.all(place <= half.radius[0])
            worst = max(worst, place.max())
    assert worst > 0


@pytest.mark.parametrize(("variant", "coordinates"), VARIANTS)
def test_energies_of_all_states_are_inside_the_bounds(variant, coordinates):
    rng = np.random.default_rng(2)
    config = random_config(variant, coordinates, 3)
    states, _ = random_set(config, 4, width=2e-2, error=1e-3)
    narrow = MotionSet(states.space, states.polynomial * 1.0, states.frame, states.radius * 1e-12)
    with proof_precision():
        energy = equations_of(partial(enclosed_system, config)).energy
        (low,), (high,) = states.bounds(energy)
        inner = [float(bound[0]) for bound in narrow.bounds(energy)]
    with ctx.workprec(BITS):
        system = enclosed_system(config, decimal_balls)
    found = []
    for one, (least, most) in ((states, (low, high)), (narrow, inner)):
        energies = []
        for z, w in points(rng, one, 6):
            with ctx.workprec(BITS):
                y = state_of(one, z.tolist(), w.tolist())
                value = sum(system.observe(y).energy.tolist(), arb(0))
                assert least <= value <= most
                energies.append(float(value))
        found.append(max(energies) - min(energies))
    assert low < inner[0] < inner[1] < high
    # z moves the energy by much more than w does in the narrow set.
    assert found[1] > 0.1 * (inner[1] - inner[0])
    assert found[0] > 0.02 * (high - low)


def test_bounds_of_one_state_have_the_rounding():
    config = random_config("free", "Z", 3)
    states, _ = random_set(config, 4, width=0.0, error=0.0)
    with proof_precision():
        (low,), (high,) = states.bounds(equations_of(partial(enclosed_system, config)).energy)
    with ctx.workprec(BITS):
        system = enclosed_system(config, decimal_balls)
        y = state_of(states, [0.0, 0.0], np.zeros(12))
        value = sum(system.observe(y).energy.tolist(), arb(0))
        assert low < value < high
        assert high - low < 1e-9


def test_a_function_without_bounds():
    """The angle is wider than the series of its sine allows."""
    config = random_config("permanent", "reduced", 3)
    states, _ = random_set(config, 4)
    wide = states.polynomial.copy()
    wide[0, 0, 1] = 3.0
    several = together(states, replace(states, polynomial=wide), states)
    with proof_precision(), np.errstate(all="ignore"):
        low, high = several.bounds(equations_of(partial(enclosed_system, config)).energy)
    assert (np.isfinite(low).tolist(), np.isfinite(high).tolist()) == ([True, False, True],) * 2
    assert not high[1] < np.inf


def test_angles_of_all_states_are_inside_the_bounds(rng):
    states, _ = random_set(random_config("free", "Z"), width=0.3, error=1e-2)
    (low,), (high,) = states.angle_bounds()
    seen = []
    for z, w in points(rng, states, 30):
        y = state_of(states, z.tolist(), w.tolist())
        for i in range(3):
            assert low[i] <= y[i] <= high[i]
        seen.append([float(entry) for entry in y[:3]])
    assert np.all(np.ptp(seen, axis=0) > 0.3 * (high - low))


def test_the_bounds_of_angles_are_reached_at_corners():
    space = Monomials(2, 2)
    polynomial = np.zeros((6, len(space)))
    polynomial[:3, 0] = (0.1, -0.2, 0.3)
    polynomial[0, 1:] = (0.2, -0.1, 0.03, -0.02, 0.01)
    frame = np.eye(6)
    frame[1, 4] = -2.0
    states = MotionSet(space, polynomial[np.newaxis], frame[np.newaxis], np.full((1, 6), 0.01))
    (low,), (high,) = states.angle_bounds()
    assert low == pytest.approx([0.1 - 0.36 - 0.01, -0.2 - 0.03, 0.29])
    assert high == pytest.approx([0.1 + 0.36 + 0.01, -0.2 + 0.03, 0.31])
    assert np.all(low < [0.1 - 0.37, -0.23, 0.29])
    assert np.all(high > [0.1 + 0.37, -0.17, 0.31])
    assert states.error[0] == pytest.approx([0.01, 0.03, 0.01, 0.01, 0.01, 0.01])


def test_bounds_of_a_polynomial_are_rounded_outwards():
    """0.1 + 0.2 z has its ends at 0.3 and -0.1, up to what doubles miss."""
    low, high = _bounds(np.array([0.1, 0.2]), np.zeros(()))
    with ctx.workprec(BITS):
        for z in (-1, 1):
            value = value_at(Monomials(1, 1), [0.1, 0.2], [z])
            assert low < value < high
    exact = _bounds(np.array([1.0, 0.0]), np.zeros(()))
    assert exact[0] < 1.0 < exact[1] < 1.0 + 1e-15


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_bounds_that_are_not_finite_stay_visible(bad):
    """No comparison of an energy with a level holds for them."""
    for polynomial, remainder in (([bad, 0.1], 0.0), ([0.0, bad], 0.0), ([0.0, 0.1], abs(bad))):
        with np.errstate(all="ignore"):
            low, high = _bounds(np.array(polynomial), np.array(remainder))
        assert not high < 1e300
        assert not low > -1e300


def test_a_set_is_halved_where_it_is_bent():
    space = Monomials(3, 2)
    polynomial = np.zeros((1, 2, len(space)))
    polynomial[0, 0, 1:4] = (5.0, 0.0, 9.0)
    states = MotionSet(space, polynomial, np.eye(2)[np.newaxis], np.zeros((1, 2)))
    # Nothing is bent: the widest.
    assert states.nonlinearity(np.ones(2)).tolist() == [[5.0, 0.0, 9.0]]
    polynomial[0, 1, space.place[0, 2, 0]] = 0.1
    polynomial[0, 1, space.place[1, 1, 0]] = -0.5
    assert states.nonlinearity(np.array([1.0, 10.0]))[0] == pytest.approx([0.05, 0.07, 0.0])
