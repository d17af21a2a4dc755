"""The cost of a switch, in steps, checks and memory, does not grow with the switches so far.

The tests count what a run does; they do not measure time.
"""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
from support.problems import each_engine
from support.sliding import ball_in_a_V, paper_problem, solve_sliding


def alone(problem, **switching):
    """Return a problem without the second run, with other rules for its switches."""
    rules = replace(problem.switching, **switching)
    return replace(problem, diagnosed=False, switching=rules)


def steps_per_switch(problem, begin, end):
    """Return the steps per switch between two numbers of switches."""
    runs = [solve_sliding("heyoka", alone(problem, switch_limit=n)) for n in (begin, end)]
    totals = [int(run.switches.counts[-1].sum()) for run in runs]
    assert totals == pytest.approx([begin, end], abs=2)
    return (runs[1].steps - runs[0].steps) / (end - begin)


def balls(times, damping=(2.4, 2.6, 2.8)):
    """Return three damped balls, whose rates of switches grow as exp(dt/3)."""
    return ball_in_a_V(
        2.0, 3000.0, np.zeros(3), np.array(damping), np.full(3, 1e-9), np.array([0.8, 1.0, 1.2]),
        np.array(times),
    )  # fmt: skip


def test_a_switch_takes_as_many_steps_at_the_end_as_at_the_beginning():
    problem = balls([0.0, 6.0])
    first = steps_per_switch(problem, 100, 1500)
    last = steps_per_switch(problem, 13_500, 15_000)
    assert last == pytest.approx(first, rel=0.1)
    # Each step ends at a switch, but those that missed one.
    assert last < 1.1


@each_engine
def test_what_is_stored_is_capped_and_what_is_counted_is_not(engine):
    problem = paper_problem(2000, duration=0.4, samples=3, stored_switches=5)
    run = solve_sliding(engine, alone(problem))
    assert len(run.switches.switch_times) == len(run.switches.switch_axes) == 5
    assert run.switches.counts[-1].sum() > 10


def test_memory_does_not_grow_with_switches():
    """The last run has many times the switches, and keeps only the ends of its steps."""
    peaks, totals = [], []
    for duration in (0.5, 0.5, 3.5):
        problem = alone(balls([0.0, duration], (2.6, 2.6, 2.6)), stored_switches=100)
        tracemalloc.start()
        try:
            run = solve_sliding("heyoka", problem)
            peaks.append(tracemalloc.get_traced_memory()[1])
        finally:
            tracemalloc.stop()
        totals.append(run.switches.counts[-1].sum())
    # The first run of all fills caches.
    assert totals[2] > 5 * totals[1] > 2500
    # The state, its rates and the time at both ends of each step, of at most 20,000 steps.
    ends = 8 * 4 * (len(problem.start) + 1) * min(run.steps, 20_000)
    assert peaks[2] < peaks[1] + 20_000 + ends
