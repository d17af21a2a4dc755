"""Enclosures of motions hold the exact motions, known to 30 digits by another method."""

from dataclasses import replace
from itertools import pairwise, product, takewhile

import numpy as np
import pytest
from flint import arb, ctx
from scipy.integrate import solve_ivp
from support.configs import BY_VARIANT
from support.enclosures import config_of, enclosure, outside
from support.exact_motions import middles, motion_of, state_after

from rbstab.analysis.exact import decimal_balls
from rbstab.analysis.motion_proof import motion as motion_module
from rbstab.analysis.motion_proof import step as step_module
from rbstab.analysis.motion_proof.expansion import NARROW, Expansion
from rbstab.analysis.motion_proof.linear_flow import LinearBounds, frame_of
from rbstab.analysis.motion_proof.motion import (
    PRECISION,
    Unproved,
    angle_bounds,
    enclosed_motion,
    energy_bounds,
)
from rbstab.analysis.motion_proof.step import StateSet, step_from
from rbstab.analysis.motion_proof.taylor import disc_bounds
from rbstab.config.build import problem_of, system_of
from rbstab.mechanics.derivatives import jacobian


def enclosed_at(config, t):
    """Return the middle of the enclosure at a time, its width, and the number of steps."""
    with ctx.workprec(PRECISION):
        for count, step in enumerate(enclosed_motion(*enclosure(config)), start=1):
            if step.end_time >= t:
                return *step.state_at(t), count
    raise AssertionError


@pytest.mark.parametrize("variant", BY_VARIANT)
@pytest.mark.parametrize("seed", [1, 2])
def test_the_exact_motion_is_inside(variant, seed):
    config = config_of(variant, seed)
    t, exact, change = list(motion_of(config, 2.0**-8, 5))[-1]
    assert change < 1e-30
    middle, distance, steps = enclosed_at(config, t)
    assert steps > 1
    assert outside(exact, middle, distance) == [0.0] * len(exact)
    assert distance.max() < 1e-13


@pytest.mark.parametrize("variant", BY_VARIANT)
def test_the_error_is_not_far_below_its_bound(variant):
    """In one step, so that what is left out of the bound would be seen."""
    config = config_of(variant, 3)
    with ctx.workprec(PRECISION):
        step = next(enclosed_motion(*enclosure(config)))
        middle, distance = step.state_at(step.end_time)
    *_, (_, exact, change) = motion_of(config, step.end_time / 4, 4)
    assert change < 1e-30
    assert outside(exact, middle, distance) == [0.0] * len(exact)
    error = [float(abs(e - m)) / d for e, m, d in zip(exact, middle, distance, strict=True)]
    assert max(error) > 3e-3
    assert np.all(np.abs(in_frame(exact, step.step.end)) <= step.step.end.radius)


@pytest.mark.parametrize("variant", BY_VARIANT)
@pytest.mark.parametrize("bits", [30, 45])
def test_an_enclosure_in_few_bits_holds_as_well(variant, bits):
    """There, the rounding of the centre and of the coefficients is the largest error."""
    config = config_of(variant, 10)
    with ctx.workprec(bits):
        motion = enclosed_motion(*enclosure(config))
        steps = [next(motion) for _ in range(4)]
        middle, distance = steps[-1].state_at(steps[-1].end_time)
    t = steps[-1].end_time
    *_, (_, exact, change) = motion_of(config, t / 8, 8)
    assert change < 1e-25
    assert outside(exact, middle, distance) == [0.0] * len(exact)
    assert np.all(np.abs(in_frame(exact, steps[-1].step.end)) <= steps[-1].step.end.radius)


def in_frame(exact, states):
    """Return the place of an exact state in the frame of a set."""
    with ctx.workprec(220):
        apart = [float(e - c) for e, c in zip(exact, states.centre, strict=True)]
    return np.linalg.solve(states.frame, np.array(apart))


@pytest.mark.parametrize(("size", "reached"), [(1e-7, 0.3), (1e-12, 0.999)])
@pytest.mark.parametrize("variant", ["permanent", "visco-elastic"])
def test_every_start_of_a_set_stays_in_it(variant, size, reached):
    """For each axis of the set at the end, the two corners that reach farthest along it.

    In the large set the curvature of the motion counts. In the small one the bounds are so close
    that a part of them that is missing would be seen.
    """
    config = config_of(variant, 4)
    with ctx.workprec(PRECISION):
        system, start, scale = enclosure(config)
        n = len(scale)
        start = StateSet(start.centre, start.frame, np.full(n, size))
        step = step_from(system.rates, start, scale, 0.004)
    assert step is not None
    with ctx.workprec(220):
        exact_system = system_of(config, decimal_balls)
    ends = {}
    for axis in range(n):
        for sign in (-1.0, 1.0):
            corner = sign * np.sign(moved_frame(config, start, step)[axis])
            with ctx.workprec(220):
                shift = (start.frame @ (corner * start.radius)).tolist()
                y = middles([c + x for c, x in zip(start.centre, shift, strict=True)])
            end = in_frame(state_after(exact_system, y, step.h), step.end)
            # The comparison is in doubles, with errors far below the smallest part of the bound.
            assert np.all(np.abs(end) <= step.end.radius * (1 + 1e-13))
            ends[axis, sign] = abs(end[axis]) / step.end.radius[axis]
    assert min(ends.values()) > reached


def moved_frame(config, start, step):
    """Return Q1⁻¹ M Q0 by finite differences, M the Jacobian of the flow over the step."""
    doubles, n = problem_of(config).system, len(start.radius)
    centre = np.array([float(x) for x in start.centre])
    columns = []
    for column in start.frame.T:
        ends = [
            solve_ivp(
                lambda _, y: doubles.rates(y),
                (0, step.h),
                centre + 1e-4 * sign * column,
                rtol=1e-11,
                atol=1e-11,
                method="DOP853",
            ).y[:, -1]
            for sign in (-1, 1)
        ]
        columns.append((ends[1] - ends[0]) / 2e-4)
    assert len(columns) == n
    return np.linalg.solve(step.end.frame, np.array(columns).T)


def test_the_bounds_of_a_step_satisfy_their_inequality():
    rng = np.random.default_rng(11)
    n, found = 4, 0
    for size in (0.1, 0.3, 0.5, 0.9):
        linear = LinearBounds(
            residual=1e-2 * rng.uniform(0, size, (n, n)),
            backward=np.eye(n) + rng.uniform(0, size, (n, n)),
            forward=np.eye(n) + rng.uniform(0, size, (n, n)),
            mismatch=rng.uniform(0, 0.4 * size, (n, n)),
        )
        radius, hd = rng.uniform(0, 1e-9, n), rng.uniform(0, 1e-9, n)
        hM, margin = rng.uniform(0, 5, (n, n)), rng.uniform(1e-4, 1e-3, n)
        bounds = step_module._error_bounds(linear, radius, hd, hM, margin)
        if bounds is None:
            continue
        found += 1
        b, W = bounds.distance, bounds.in_frame
        G = hM * np.max(b / margin)
        assert np.all(radius + linear.residual @ b + linear.backward @ (G @ b + hd) <= W)
        assert np.all(linear.forward @ W + linear.mismatch @ b < b)
    assert found > 1
    hopeless = replace(linear, mismatch=2 * np.eye(n))
    assert step_module._error_bounds(hopeless, radius, hd, hM, margin) is None


def first_flow(config, order, h):
    """Return start, scale, polynomial, linear flow and ratio of a first step."""
    system, start, scale = enclosure(config)
    expansion = Expansion(system.rates, start.centre, NARROW._replace(order=order))
    bounds = disc_bounds(system.rates, expansion.p, h, step_module.RATIO, 1e-4 * scale)
    return start, scale, expansion.p, *step_module._flow(expansion, h, bounds, scale)


def test_a_step_that_is_shortened_keeps_its_disc():
    """The bounds are those of the disc of the longer step."""
    h = 2.0**-6
    with ctx.workprec(PRECISION):
        *_, flow, ratio = first_flow(config_of("visco-elastic", 12), 6, h)
    assert flow.h < h
    assert ratio * flow.h <= step_module.RATIO * h
    assert ratio * flow.h == pytest.approx(step_module.RATIO * h)


def test_the_energy_of_a_set():
    config = config_of("embedded", 6)
    with ctx.workprec(PRECISION):
        system, start, scale = enclosure(config)
        wide = StateSet(start.centre, start.frame, np.full(len(scale), 1e-3))
        low, high = energy_bounds(system, wide)
        exact = energy_bounds(system, start)
    doubles = problem_of(config).system
    rng = np.random.default_rng(8)
    centre = np.array([float(x) for x in start.centre])
    energies = [
        doubles.observe(centre + wide.frame @ (1e-3 * corner)).energy.sum()
        for corner in rng.choice([-1.0, 1.0], size=(200, len(scale)))
    ]
    assert low < min(energies)
    assert max(energies) < high
    assert max(energies) - min(energies) > 0.1 * (high - low)
    # The corners along the gradient: there the curvature adds to the slope.
    gradient = jacobian(lambda y: doubles.observe(y).energy.sum(), centre)
    corner = np.sign(gradient @ wide.frame)
    edge = 1e-3 * wide.frame @ corner
    farthest = [doubles.observe(centre + x * edge).energy.sum() for x in (-1, 1)]
    assert low <= min(farthest)
    assert max(farthest) <= high
    assert max(farthest) - doubles.observe(centre).energy.sum() > 0.9 * (high - low) / 2
    assert exact[0] <= doubles.observe(centre).energy.sum() * (1 + 1e-14)
    assert exact[1] - exact[0] < 1e-10


def test_the_angles_of_a_set():
    frame = np.eye(6)
    frame[0, 3] = 2.0
    states = StateSet([arb(x) for x in (0.1, -0.2, 0.3, 1, 2, 3)], frame, np.full(6, 0.01))
    low, high = angle_bounds(states)
    assert low == pytest.approx([0.07, -0.21, 0.29])
    assert high == pytest.approx([0.13, -0.19, 0.31])
    corners = [states.centre[0] + s * 0.01 + 0.02 * t for s, t in product((-1, 1), repeat=2)]
    assert all(low[0] <= float(x) <= high[0] for x in corners)


def test_a_motion_that_comes_near_the_border_of_the_angles_is_given_up():
    given = config_of("permanent", 7)
    initial = {"orientation": (0.0, 1.5, 0.0), "angular_velocity": (0.0, 300.0, 0.0)}
    fast = given.model_copy(update={"initial": given.initial.model_copy(update=initial)})
    with ctx.workprec(PRECISION):
        motion = enclosed_motion(*enclosure(fast))
        with pytest.raises(Unproved):
            list(takewhile(lambda step: step.end_time < 1.0, motion))


def test_times_are_sums_without_rounding():
    config = config_of("free", 9)
    with ctx.workprec(PRECISION):
        motion = enclosed_motion(*enclosure(config))
        steps = [next(motion) for _ in range(5)]
    for before, after in pairwise(steps):
        assert after.time == before.end_time
        assert (after.time * 2.0**40).is_integer()


@pytest.mark.parametrize("rate", [1e15, 1e30])
def test_a_system_that_is_too_stiff_for_any_step_is_given_up(rate):
    """Steps never have the length zero, which would not end, and infinite terms are no error."""

    def stiff(y):
        out = np.empty(2, dtype=object)
        out[0], out[1] = y[0] * -rate, y[1] * 0.0 + 1.0
        return out

    start = StateSet([arb(0), arb(0)], np.eye(2), np.zeros(2))
    with np.errstate(all="ignore"):
        assert step_from(stiff, start, np.ones(2), 0.01) is None


@pytest.mark.parametrize("scale", [np.nan, np.inf, 0.0])
def test_no_scale_leads_to_an_exception(scale):
    config = config_of("permanent", 13)
    with ctx.workprec(PRECISION), np.errstate(all="ignore"):
        system, start, sizes = enclosure(config)
        sizes[4] = scale
        assert step_from(system.rates, start, sizes, 0.01) is None


def test_a_state_between_the_ends_has_its_rounding():
    """In few bits the value of the polynomial is rounded much; the distance includes that."""
    config = config_of("free", 14)
    with ctx.workprec(PRECISION):
        step = next(enclosed_motion(*enclosure(config)))
    t = step.time + 0.6 * step.step.h
    with ctx.workprec(20):
        middle, distance = step.state_at(t)
    with ctx.workprec(220):
        powers = [arb(t) ** k for k in range(len(step.step.p[0]))]
        exact = [
            sum((c * x for c, x in zip(row, powers, strict=True)), arb(0)) for row in step.step.p
        ]
        apart = [float(abs(e - m)) for e, m in zip(exact, middle, strict=True)]
    assert max(apart) > 1e-9
    assert np.all(np.array(apart) <= distance - step.step.distance)


def test_a_motion_is_given_up_when_its_time_would_be_rounded(monkeypatch):
    config = config_of("free", 16)
    with ctx.workprec(PRECISION):
        first = next(enclosed_motion(*enclosure(config)))
        monkeypatch.setattr(motion_module, "MAX_TIME", 2.5 * first.end_time)
        motion = enclosed_motion(*enclosure(config))
        with pytest.raises(Unproved):
            list(motion)


def test_what_the_linear_flow_misses_is_in_the_set_at_the_end():
    with ctx.workprec(PRECISION):
        start, scale, p, flow, _ = first_flow(config_of("permanent", 15), 20, 2.0**-8)
        frame = frame_of(start.frame)
        assert frame is not None
        errors = step_module._ErrorBounds(np.zeros(6), np.full(6, 1e-12))
        missed = 1e-3 * scale
        end = step_module._end(p, flow, frame, errors, missed, scale)
    assert end is not None
    for axis in range(6):
        corner = np.linalg.solve(end.frame, missed * np.eye(6)[axis])
        assert np.all(np.abs(corner) <= end.radius)
