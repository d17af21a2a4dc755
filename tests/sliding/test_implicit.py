"""The implicit law is backward Euler for the connector: no chatter, and damped by its step."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import lsq_linear
from support.problems import each_engine
from support.sliding import SLOPE_REFERENCE, audit, ball_in_a_V, paper_problem, solve_sliding

from rbstab.integrate.implicit import with_sides
from rbstab.integrate.status import RunStatus
from rbstab.mechanics.constraint import mobility
from rbstab.mechanics.motion import contact_directions

M, K = 2.0, 30.0


def ball(x, times, step):
    return ball_in_a_V(M, K, np.zeros(3), np.zeros(3), np.full(3, x), np.zeros(3), times, step=step)


@each_engine
def test_each_step_of_a_flight_loses_the_same_energy(engine):
    """F⁺ = F - hk and E⁺ = E + hF⁺ lose ½h²k² of ½F² + kE, per unit of mass."""
    h, k = 1e-3, K / M
    times = np.linspace(0, 0.1, 101)
    run = solve_sliding(engine, ball(1.0, times, h))
    assert run.steps == 100
    E, F = run.states[:, 6], run.states[:, 9]
    assert pytest.approx(-k * times, abs=1e-12) == F
    energy = 0.5 * F**2 + k * E
    assert energy == pytest.approx(energy[0] - 0.5 * h * k * k * times, abs=1e-12)
    # The sum over three axes, in joules.
    assert run.switches.discarded_energy == pytest.approx(3 * M * 0.5 * h * k * k * times)


@pytest.mark.parametrize("h", [1e-4, pytest.param(5e-5, marks=pytest.mark.slow)])
def test_the_time_of_sticking_is_the_step_s(h):
    """The ball sticks at x/(hk), though the exact undamped ball bounces forever.

    A step without a crossing loses ½h²k² of e = ½F² + k|E|. A step with a crossing loses 2k|E|
    more, on average kh|F|, and there is one every 2|F|/k. Together ė = -hk², from e = kx.
    """
    x, k = 0.002, K / M
    expected = x / (h * k)
    run = solve_sliding("heyoka", ball(x, np.linspace(0, 2 * expected, 201), h))
    stuck = [time for time, _, _ in run.switches.transitions]
    assert stuck[-1] == pytest.approx(expected, rel=0.05)
    assert np.abs(run.states[-1, 6:12]).max() < 1e-15
    assert run.switches.modes[-1].tolist() == [0, 0, 0]


def test_paper_s_body_is_stuck_from():
    """Another program gives 0.064 s."""
    run = solve_sliding("heyoka", paper_problem(20000, duration=0.2, samples=201, step=1e-3))
    off = (run.switches.modes != 0).any(axis=1)
    assert run.times[off][-1] == pytest.approx(0.064, abs=0.0021)


def test_on_a_slope_it_converges_to_the_exact_law_like_its_step():
    errors = []
    for h in (1e-3, 1e-4, 1e-5):
        run = solve_sliding(
            "heyoka", paper_problem(20000, slope=20.0, duration=0.5, samples=11, step=h)
        )
        state = next(s for s in SLOPE_REFERENCE["states"] if float(s["t"]) == 0.5)
        motion = run.systems[-1].motion(run.states[-1])
        errors.append(np.abs(motion.Theta - state["Theta"]).max())
    assert errors[1] / errors[0] == pytest.approx(0.1, rel=0.2)
    assert errors[2] / errors[1] == pytest.approx(0.1, rel=0.2)


@pytest.mark.parametrize("slope", [None, 20.0])
def test_the_force_of_a_step_is_that_of_a_bounded_least_squares_problem(slope):
    """Λ ∈ -K_s Sgn(MΛ + q) minimises ½Λ'MΛ + q'Λ over |Λ| <= K_s, by another solver."""
    problem = paper_problem(20000, slope=slope, duration=0.07, samples=71, step=1e-3)
    run = solve_sliding("heyoka", problem)
    h, unforced = 1e-3, with_sides(problem.system, np.zeros(3))
    weight = (1.0 if slope else 0.0) + (slope or 1.0) * h
    held = 0
    for before, after, system in zip(run.states, run.states[1:], run.systems[1:], strict=False):
        motion = unforced.motion(before)
        W = mobility(unforced.body, contact_directions(unforced.body, motion))
        F = motion.F + h * unforced.rates(before)[9:12]
        q = weight * F + (slope or 1.0) * motion.E
        root = np.linalg.cholesky(weight * h * W)
        solved = lsq_linear(root.T, -np.linalg.solve(root, q), (-20000.0, 20000.0), tol=1e-14)
        force = system.observe(after).contact_force
        assert force == pytest.approx(solved.x, abs=1e-2)
        held += int((np.abs(force) < 19999).sum())
    assert held > 10


def test_what_it_takes_is_accounted_for():
    """The rest of the residual is the error of the smooth part, which falls with the step."""
    residuals = [
        audit(solve_sliding("heyoka", paper_problem(20000, duration=0.5, samples=51, step=h)))
        for h in (1e-3, 1e-4, 1e-5)
    ]
    assert residuals[0] < 1e-2
    assert residuals[2] < residuals[1] / 3 < residuals[0] / 9


def test_steps_are_shortened_to_meet_the_samples():
    run = solve_sliding("heyoka", paper_problem(20000, duration=0.1, samples=11, step=3e-3))
    assert run.steps == 10 * 4
    assert run.times == pytest.approx(np.linspace(0, 0.1, 11), abs=1e-15)


@each_engine
def test_limits_and_failures_are_statuses(engine):
    limited = solve_sliding(engine, paper_problem(20000, step=1e-3, switch_limit=3))
    assert limited.status is RunStatus.SWITCH_LIMIT
    assert limited.switches.counts[-1].sum() >= 3
    too_long = solve_sliding(engine, paper_problem(20000, step=0.05))
    assert too_long.status in {RunStatus.DIVERGED, RunStatus.RANGE_LEFT}


def test_a_held_axis_is_on_its_surface_after_one_step():
    problem = paper_problem(1e9, slope=20.0, duration=1e-3, samples=2, step=1e-3)
    start = problem.start.copy()
    start[6:9] = 0.01, -0.02, 0.03
    run = solve_sliding("scipy", replace(problem, start=start))
    E, F = run.states[-1, 6:9], run.states[-1, 9:12]
    assert pytest.approx(np.zeros(3), abs=1e-12) == F + 20.0 * E
    assert pytest.approx(start[6:9] + 1e-3 * F, abs=1e-15) == E
    assert run.switches.modes[-1].tolist() == [0, 0, 0]
