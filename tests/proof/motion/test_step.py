"""Steps of sets of motions hold the exact motions, known to 25 digits by another method."""

from dataclasses import replace

import numpy as np
import pytest
from flint import arb, ctx
from support.exact_motions import state_after
from support.motion_steps import (
    LONGEST,
    assert_equal,
    ends,
    equations,
    exact_system,
    some_starts,
    stepped,
    tried,
)
from support.polynomial_sets import BITS, place_in_frame, state_of, value_at
from support.start_sets import VARIANTS, random_config, random_set, together

from rbstab.proof.motion.linear_flow import LinearBounds
from rbstab.proof.motion.models import Models, evaluated
from rbstab.proof.motion.step import (
    TIME_GRID,
    Disturbance,
    _defect,
    _error_bounds,
    _series,
    set_steps,
)

POINT = {"variables": 0, "degree": 0}


@pytest.mark.parametrize(("variant", "coordinates"), VARIANTS)
@pytest.mark.parametrize(
    ("width", "error", "reached"), [(1e-2, 1e-6, 0.1), (1e-3, 1e-9, 0.5), (1e-5, 1e-13, 0.02)]
)
def test_every_start_of_a_set_ends_in_it(variant, coordinates, width, error, reached):
    """The bounds are so close that a part of them that is missing would be seen."""
    config = random_config(variant, coordinates, 5)
    states, scale = random_set(config, 7, width=width, error=error)
    step = stepped(config, states, scale)
    worst = [np.abs(end).max() for end in ends(config, states, step, some_starts(states, 5))]
    assert reached < max(worst) <= 1


def test_a_thin_set_bends():
    """By the differences of slopes across it; beside a line there is no room for them."""
    config = random_config("permanent", "reduced", 5)
    states, scale = random_set(config, 7, width=0.0, error=0.0)
    states.radius[0, 3] = 1e-2
    step = stepped(config, states, scale, LONGEST / 32)
    places = np.abs([*ends(config, states, step, some_starts(states, 4))])
    assert 0.01 < places[:, 1:].max() <= places.max() <= 1


@pytest.mark.parametrize(("variant", "coordinates"), VARIANTS)
def test_points_over_several_steps(variant, coordinates):
    """The width stays near that of rounding, and the whole motion is inside: the tubes too."""
    config = random_config(variant, coordinates, 6)
    states, scale = random_set(config, 7, error=0.0, **POINT)
    y = state_of(states, [], [0.0] * len(scale))
    for _ in range(3):
        step = stepped(config, states, scale, 3 * LONGEST)
        h = float(step.h[0])
        assert h / TIME_GRID == np.floor(h / TIME_GRID)
        for share in (0.31, 1.0):
            low, high = step.at(share * h)
            there = state_after(exact_system(config), y, share * h)
            for a, b, c in zip(low, there, high, strict=True):
                assert arb(a) <= b <= arb(c)
        y, states = there, step.end
        assert np.all(np.abs(place_in_frame(states, [], y)) <= states.radius[0])
    assert np.all(states.error < 3e-12 * scale)


def test_what_a_polynomial_misses_is_in_the_defect():
    """p' beside hf(p), at points of τ and z, in 220 bits; also where p is no motion."""
    config = random_config("embedded", "W", 5)
    states, scale = random_set(config, 7, width=3e-2)
    field, rng, n = equations(config).field(), np.random.default_rng(1), len(scale)
    h, series, _ = _series(field, states, scale, np.array([2 * LONGEST]))
    seen = []
    for spoilt in (0.0, 1e-3):
        p = series[:, :n].copy()
        p[3] += spoilt * scale[:, np.newaxis, np.newaxis]
        models = Models(states.space, p, np.zeros((n, 1)))
        d = _defect(p, evaluated(field.rates, models), h)[0]
        for _ in range(6):
            z, tau = rng.choice([-1.0, 1.0, 0.4], 2).tolist(), float(rng.choice([0.0, 0.9, 1.0]))
            with ctx.workprec(BITS):
                rows = [
                    [value_at(states.space, row, z) for row in coefficients]
                    for coefficients in p[:, :, 0].tolist()
                ]
                y = sum(np.array(row, dtype=object) * arb(tau) ** k for k, row in enumerate(rows))
                rate = sum(
                    np.array(row, dtype=object) * (k * arb(tau) ** (k - 1))
                    for k, row in enumerate(rows)
                    if k
                )
                missed = exact_system(config).rates(y) * arb(float(h[0])) - rate
            apart = np.abs(missed.astype(float))
            assert np.all(apart <= d)
            seen.append((apart / d).max())
    assert max(seen[:6]) > 1e-4
    assert max(seen[6:]) > 0.15


def test_the_bounds_of_a_step_satisfy_their_inequality():
    """And are within the margin; of several steps at once, one of them hopeless."""
    rng, n = np.random.default_rng(11), 4
    sizes = np.array([0.1, 0.3, 9.0, 0.5, 0.2])[:, np.newaxis, np.newaxis]
    shape = (len(sizes), n, n)
    eye, some = np.eye(n), [sizes * rng.uniform(0, 1, shape) for _ in range(4)]
    linear = LinearBounds(1e-4 * some[0], eye + some[1], eye + some[2], 0.1 * some[3])
    radius, d = rng.uniform(0, 1e-9, (2, len(sizes), n))
    G, margin = rng.uniform(0, 1e-3, shape), np.full((len(sizes), n), 1e-7)
    b, W, bounded = _error_bounds(linear, radius, d, G, margin)
    assert bounded.tolist() == [True, True, False, True, True]
    for k in np.flatnonzero(bounded):
        assert np.all(b[k] <= margin[k])
        by_b = linear.residual[k] @ b[k] + linear.backward[k] @ (G[k] @ b[k])
        assert np.all(radius[k] + by_b + linear.backward[k] @ d[k] <= W[k])
        assert np.all(linear.forward[k] @ W[k] + linear.mismatch[k] @ b[k] < b[k])
    assert not _error_bounds(linear, radius, d, G, 0.5 * np.minimum(b, margin))[2].any()
    # A step that would widen the set by its own estimates is refused.
    assert not _error_bounds(linear, radius, d, 100 * G, 1e9 * margin)[2][1]


@pytest.mark.parametrize("shape", [{"variables": 2, "degree": 4}, POINT])
def test_steps_of_many_sets_are_those_of_each_alone(shape):
    """Bit for bit, also beside sets without bounds, of which nothing is proved."""
    config = random_config("visco-elastic", "W", 5)
    sets = [
        random_set(config, seed, width=width, error=error, **shape)
        for seed, width, error in [(7, 1e-2, 1e-6), (8, 1e-4, 0.0), (9, 3.0, 1.0), (10, 3e-2, 1e-9)]
    ]
    scale, sets = sets[0][1], [states for states, _ in sets]
    for bad in (np.nan, np.inf, 1e300):
        for name in ("polynomial", "radius", "frame"):
            spoilt = getattr(sets[0], name).copy()
            spoilt.flat[0] = bad
            sets.append(replace(sets[0], **{name: spoilt}))
    longest = LONGEST * np.resize([1.0, 0.3, 0.7, 2.0], len(sets))
    many = tried(config, together(*sets), scale, longest)
    assert many.proved.tolist()[:2] == [True, True]
    assert not many.proved[4:].any()
    for k, states in enumerate(sets[:4]):
        alone = tried(config, states, scale, longest[k])
        assert many.proved[k] == alone.proved[0]
        if alone.proved[0]:
            assert_equal(many, k, alone, 0)


def test_no_step_is_proved_where_cos_theta2_may_be_zero():
    config = random_config("free", "Z", 5)
    states, scale = random_set(config, 7, width=0.0)
    states.polynomial[0, 1, 0], states.polynomial[0, 1, 1] = np.pi / 2, 0.1
    for shorter in (1.0, 2.0**-16, 2.0**-24):
        assert not tried(config, states, scale, shorter * LONGEST).proved.any()


def test_a_disturbance_is_in_the_set_at_the_end():
    """ẏ = f(y) + δ with the largest constant δ, for each sign of each state."""
    config = random_config("permanent", "reduced", 5)
    states, scale = random_set(config, 7, error=1e-9, **POINT)
    D = 1e-7 * scale
    given = Disturbance(lambda _: D[np.newaxis], D[np.newaxis])
    step = set_steps(equations(config).field(), states, scale, np.array([LONGEST]), given)
    assert step.proved[0]
    exact, worst = exact_system(config), 0.0
    for i in range(len(scale)):
        for sign in (-1.0, 1.0):

            class Disturbed:
                @staticmethod
                def rates(y, i=i, sign=sign):
                    disturbed = exact.rates(y)
                    disturbed[i] = disturbed[i] + arb(sign * float(D[i]))
                    return disturbed

            y = state_of(states, [], [0.0] * len(scale))
            end = state_after(Disturbed, y, float(step.h[0]))
            place = place_in_frame(step.end, [], end) / step.end.radius[0]
            worst = max(worst, np.abs(place).max())
            assert worst <= 1
            low, high = step.at(float(step.h[0]))
            assert all(arb(a) <= b <= arb(c) for a, b, c in zip(low, end, high, strict=True))
    assert worst > 0.1
