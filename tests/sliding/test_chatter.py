"""The surface s = E of eq. 39, of relative degree two: the point bounces instead of sliding."""

import numpy as np
import pytest
from support.sliding import audit, follow, paper_problem

from rbstab.integrate.status import RunStatus


@pytest.fixture(scope="module")
def weak():
    return follow("heyoka", paper_problem(2000, duration=1.4, samples=15))


@pytest.fixture(scope="module")
def strong():
    return follow("heyoka", paper_problem(20000, duration=1.0, samples=11))


def switches_at(run, time):
    (row,) = np.flatnonzero(np.isclose(run.times, time))
    return run.switches.counts[row].sum()


def test_switches_while_they_can_be_predicted(weak, strong):
    """Counted by another program; later the motion is chaotic and only bands are known."""
    assert switches_at(weak, 0.2) == 5
    assert switches_at(weak, 0.6) == 71
    assert switches_at(strong, 0.2) == 159


def test_switches_beyond(weak, strong):
    """Bands of another program, 430 to 670, 2.5e3 to 3e4, and 870 to 1000, over a few starts.

    They are widened three times: which of the chaotic motions a program follows is decided by its
    last digits, and the counts of neighbouring starts spread that far.
    """
    assert 140 < switches_at(weak, 1.0) < 2000
    assert 800 < switches_at(weak, 1.4) < 90_000
    assert 290 < switches_at(strong, 0.6) < 3000


def test_engines_agree_while_it_is_possible():
    problem = paper_problem(2000, duration=0.2, samples=21)
    runs = [follow(name, problem) for name in ("heyoka", "scipy")]
    assert np.abs(runs[0].states - runs[1].states).max() < 1e-8
    times = [run.switches.switch_times for run in runs]
    assert times[0] == pytest.approx(times[1], abs=1e-9)


def test_energy_balances_over_all_switches(weak, strong):
    assert audit(weak) < 1e-8
    assert audit(strong) < 1e-8


def test_the_chatter_only_loses_energy_in_the_long_run(weak):
    e = weak.switches.chatter_energy
    assert e[-1] < 0.01 * e[0]


def test_trust_ends_where_an_error_has_grown_to_what_it_measures(weak, strong):
    """An error grows by about e^0.15 a switch: some 200 switches in double precision."""
    assert 0.6 < weak.switches.trusted_until < 1.0
    assert 0.1 < strong.switches.trusted_until < 0.4


def test_every_switch_is_on_the_side_that_it_says(weak):
    E, sides = weak.states[:, 6:9], weak.switches.modes
    assert (E[1:] * sides[1:] > 0).all()


def test_only_so_many_switches_are_stored_and_all_are_counted():
    run = follow("heyoka", paper_problem(2000, duration=0.8, samples=9, stored_switches=10))
    full = follow("heyoka", paper_problem(2000, duration=0.8, samples=9))
    assert run.switches.switch_times.tolist() == full.switches.switch_times[:10].tolist()
    assert run.switches.counts[-1].sum() == len(full.switches.switch_times) > 100


@pytest.mark.parametrize("engine", ["heyoka", "scipy"])
def test_switch_limit(engine):
    run = follow(engine, paper_problem(2000, duration=2.0, switch_limit=20))
    assert run.status is RunStatus.SWITCH_LIMIT
    assert run.switches.counts[-1].sum() == 20
    assert run.times[-1] == pytest.approx(run.switches.switch_times[-1], abs=1e-12)


@pytest.mark.parametrize("bound", [10.0, 100.0])
def test_sticking(bound):
    run = follow("heyoka", paper_problem(20000, stick_energy=bound))
    stuck, _, _ = run.switches.transitions[0]
    after = run.times > stuck
    assert run.status is RunStatus.COMPLETED
    assert 0 < run.switches.discarded_energy[-1] <= bound
    assert np.abs(run.states[after, 6:12]).max() < 1e-12
    assert (run.switches.modes[after] == 0).all()
    assert audit(run) < 1e-8


def test_nothing_sticks_where_the_connector_is_too_weak_to_hold():
    """Until about 0.1 s the held point needs more than 2000 N."""
    run = follow("heyoka", paper_problem(2000, duration=0.1, stick_energy=1e9))
    held_from_the_start = [axis for time, axis, _ in run.switches.transitions if time < 0.01]
    assert len(held_from_the_start) < 3


@pytest.mark.parametrize("engine", ["heyoka", "scipy"])
def test_a_start_that_is_not_finite_diverged(engine):
    problem = paper_problem(2000)
    problem.start[4] = np.nan
    run = follow(engine, problem)
    assert run.status is RunStatus.DIVERGED
    assert len(run.times) == 1
