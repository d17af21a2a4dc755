"""The cost of a switch, in steps, checks and memory, does not grow with the switches so far.

The tests count what a run does; they do not measure time.
"""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from rbstab.integrate.heyoka.flow import HeyokaFlow
from rbstab.integrate.scipy_flow import ScipyFlow
from rbstab.integrate.switching.filippov import FilippovDriver
from support.sliding import ball_in_a_V, paper_problem

from rbstab.integrate.switching import filippov


class Counted:
    """A flow that records at how many switches each of its calls is made."""

    def __init__(self, flow):
        self.flow, self.calls = flow, []

    @property
    def steps(self):
        return self.flow.steps

    @property
    def evaluations(self):
        return self.flow.evaluations

    def advance(self, start, end, log):
        self.calls.append(log.total)
        return self.flow.advance(start, end, log)


def counted(problem, kind=HeyokaFlow):
    """Return switches, steps and calls at each sample, and the driver and the flow."""
    flow = Counted(kind(problem, problem.switching))
    driver = FilippovDriver(problem, problem.switching, flow)
    rows = [(sum(s.counts), flow.steps, len(flow.calls)) for s in driver.samples()]
    return np.array(rows), driver, flow


def steps_per_switch(rows, begin, end):
    """Return the steps per switch between two fractions of all switches."""
    at = [np.argmin(np.abs(rows[:, 0] - part * rows[-1, 0])) for part in (begin, end)]
    switches, steps, _ = rows[at[1]] - rows[at[0]]
    assert switches > 0.02 * rows[-1, 0]
    return steps / switches


@pytest.fixture(scope="module")
def ball():
    """Return a run of three damped balls with 15,000 switches, at rates that grow as exp(dt/3)."""
    problem = ball_in_a_V(
        2.0, 3000.0, np.zeros(3), np.array([2.4, 2.6, 2.8]), np.full(3, 1e-9),
        np.array([0.8, 1.0, 1.2]), np.linspace(0, 6, 61),
    )  # fmt: skip
    return counted(problem)


def test_a_switch_takes_as_many_steps_at_the_end_as_at_the_beginning(ball):
    rows, _, _ = ball
    assert rows[-1, 0] > 10_000
    first, last = steps_per_switch(rows, 0.0, 0.1), steps_per_switch(rows, 0.9, 1.0)
    assert last == pytest.approx(first, rel=0.05)
    # Each step ends at a switch or at a sample.
    assert rows[-1, 1] <= 1.05 * rows[-1, 0] + len(rows)


def test_the_paper_body_takes_one_step_a_switch():
    rows, _, _ = counted(paper_problem(20000, duration=1.0, samples=101))
    assert rows[-1, 0] > 2000
    # At first the error control ends some steps, later only switches do.
    assert steps_per_switch(rows, 0.9, 1.0) < 1.1
    assert steps_per_switch(rows, 0.9, 1.0) <= steps_per_switch(rows, 0.0, 0.1)


def test_bounces_of_a_microsecond_take_one_step_each():
    """No crossing is mistaken for the one before it, which would repeat a step."""
    problem = ball_in_a_V(
        2.0, 30.0, np.zeros(3), np.zeros(3), np.full(3, 1e-18), np.array([1e-5, 1.3e-5, 0.7e-5]),
        np.array([0.0, 5e-5]),
    )  # fmt: skip
    rows, _, _ = counted(problem)
    assert rows[-1, 0] > 80
    assert rows[-1, 1] <= rows[-1, 0] + 2


def test_crossings_do_not_leave_the_compiled_flow(ball):
    """The flow is called once for each sample, however many switches lie between."""
    rows, _, flow = ball
    assert len(flow.calls) <= len(rows) + rows[-1, 1] // 20_000


def test_looks_at_which_axes_may_stick_become_rare(monkeypatch):
    """Between two checks pass 32 switches, or 1/64 of all so far: 64 ln 2 per doubling."""
    monkeypatch.setattr(filippov, "stick", lambda *_: None)
    problem = paper_problem(20000, duration=1.3, samples=2, stick_energy=1e9, switch_limit=30_000)
    rows, driver, flow = counted(problem)
    total = rows[-1, 0]
    assert total > 4000
    assert driver.log.transitions == []
    looks = np.array(flow.calls)
    for upper in (total, total / 2, total / 4):
        among = ((looks > upper / 2) & (looks <= upper)).sum()
        assert 5 < among <= 64 * np.log(2) + 3
    # The first check is at the first switch; later ones are at least 32 switches apart.
    assert looks[:2].tolist() == [0, 1]
    assert (np.diff(looks[1:]) >= 32).all()


@pytest.mark.parametrize("kind", [HeyokaFlow, ScipyFlow])
def test_what_is_stored_is_capped_and_what_is_counted_is_not(kind):
    problem = paper_problem(2000, duration=0.4, samples=3, stored_switches=5)
    rows, driver, _ = counted(problem, kind)
    assert len(driver.log.times) == len(driver.log.axes) == 5
    assert driver.log.total == sum(driver.log.counts) == rows[-1, 0] > 10
    # The log knows the last switch, though it is not stored.
    assert driver.log.last_time > driver.log.times[-1]


def test_evaluations_are_those_of_all_steps():
    """DOP853 needs 11 or 12 evaluations per step, and 4 more for its dense output."""
    problem = paper_problem(2000, duration=0.2, samples=3)
    runs = {}
    for kind in (HeyokaFlow, ScipyFlow):
        flow = kind(problem, problem.switching)
        list(FilippovDriver(problem, problem.switching, flow).samples())
        runs[kind] = flow.evaluations / flow.steps
    assert runs[HeyokaFlow] == 1
    assert 11 <= runs[ScipyFlow] < 25


def test_memory_does_not_grow_with_switches():
    """The second part of a run has many times the switches of the first, and the same peak."""
    problem = ball_in_a_V(
        2.0, 3000.0, np.zeros(3), np.full(3, 2.6), np.full(3, 1e-9), np.array([0.8, 1.0, 1.2]),
        np.array([0.0, 0.5, 3.5]),
    )  # fmt: skip
    problem = replace(problem, switching=replace(problem.switching, stored_switches=100))
    flow = HeyokaFlow(problem, problem.switching)
    driver = FilippovDriver(problem, problem.switching, flow)
    samples = driver.samples()
    next(samples)
    tracemalloc.start()
    try:
        peaks, totals = [], []
        for _ in range(2):
            tracemalloc.reset_peak()
            next(samples)
            peaks.append(tracemalloc.get_traced_memory()[1])
            totals.append(driver.log.total)
    finally:
        tracemalloc.stop()
    assert totals[1] > 5 * totals[0] > 2500
    assert peaks[1] < peaks[0] + 20_000
