"""Compiled code is reused for other problems, and keeps nothing of earlier runs.

A new thread has compiled nothing, so it computes what a new process would.
"""

import gc
import weakref
from dataclasses import replace

import heyoka
import numpy as np
import pytest
from support.hang_guard import within
from support.sliding import paper_problem, pushed_ball, solve_sliding, turning_balls

from rbstab.integrate import driven_run
from rbstab.integrate.status import RunStatus
from rbstab.integrate.switching import driver


def turning(rate, angle=0.0):
    return turning_balls(np.linspace(0, 1, 5), rate, angle)


def diverging():
    X, still, times = np.array([1.0, 2.0, -3.0]), np.zeros(3), np.linspace(0, 2, 11)
    problem = pushed_ball(2.0, np.full(3, 30.0), still, -1e6 * np.eye(3), X, still, times)
    return replace(problem, step_limit=20_000)


def beyond_numbers():
    problem = paper_problem(2000, slope=20.0, duration=0.1, samples=3)
    problem.start[3] = 1e200
    return problem


PROBLEMS = {
    "s = E": lambda: paper_problem(2000, duration=0.3, samples=4),
    "other bounds": lambda: paper_problem(1500, duration=0.2, samples=3),
    "sticking": lambda: paper_problem(20000, duration=0.5, samples=3, stick_energy=100.0),
    "s = F + 20 E": lambda: paper_problem(20000, slope=20.0, duration=0.3, samples=7),
    "s = F + 4 E": lambda: paper_problem(9000, slope=4.0, duration=0.3, samples=4),
    "layer on E": lambda: paper_problem(2000, layer=1e-3, duration=0.2, samples=3),
    "layer on F": lambda: paper_problem(20000, slope=20.0, layer=0.01, duration=0.1, samples=3),
    "implicit": lambda: paper_problem(20000, slope=20.0, duration=0.05, samples=3, step=1e-3),
    "implicit on E": lambda: paper_problem(2000, duration=0.05, samples=3, step=5e-4),
    "switch limit": lambda: paper_problem(20000, duration=1.0, samples=3, switch_limit=50),
    "step limit": lambda: replace(paper_problem(2000, duration=0.3, samples=4), step_limit=20),
    "leaving": lambda: turning(5.0),
    "tolerance": lambda: replace(turning(0.3), rtol=1e-9),
    "diverging": diverging,
    "beyond numbers": beyond_numbers,
}

ENDS = {
    "switch limit": RunStatus.SWITCH_LIMIT,
    "step limit": RunStatus.STEP_LIMIT,
    "leaving": RunStatus.RANGE_LEFT,
    "diverging": RunStatus.DIVERGED,
    "beyond numbers": RunStatus.DIVERGED,
}


def bits(run):
    """Return all results of a run in a form that can be compared."""
    arrays = (
        run.times,
        run.states,
        run.lyapunov_change,
        run.contact_work,
        *run.switches[:6],
    )
    counts = run.status, run.detail, run.steps, run.evaluations, run.switches.transitions
    return [a.tobytes() for a in arrays], counts, run.trusted_until


def bits_of(name):
    return bits(solve_sliding("heyoka", PROBLEMS[name]()))


@pytest.fixture(scope="module")
def alone():
    """Return the results of each problem from a thread that solves nothing else."""
    return {name: within(120.0, bits_of, name) for name in PROBLEMS}


def test_the_problems_end_as_they_are_meant_to(alone):
    for name, (_, counts, _) in alone.items():
        assert counts[0] is ENDS.get(name, RunStatus.COMPLETED), name
    kinds = {str(kind) for _, _, kind in alone["sticking"][1][4]}
    assert "stick" in kinds


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_no_order_of_problems_changes_a_bit(alone, seed):
    for name in np.random.default_rng(seed).permutation(list(PROBLEMS)).tolist():
        assert bits_of(name) == alone[name], name


def test_an_event_is_not_deaf_after_another_run():
    """heyoka ignores an event for 1e-10 s after it fired; this start leaves within 4e-11 s."""
    assert solve_sliding("heyoka", turning(5.0)).status is RunStatus.RANGE_LEFT
    run = solve_sliding("heyoka", turning(5.0, angle=np.arccos(1e-3) - 2e-10))
    assert run.status is RunStatus.RANGE_LEFT
    assert run.times[-1] == pytest.approx(4e-11, rel=1e-4)


@pytest.fixture
def compilations(monkeypatch):
    """Return the list of compilations, which grows as they happen."""
    made, compiler = [], heyoka.taylor_adaptive

    def counting(*args, **options):
        made.append(options["tol"])
        return compiler(*args, **options)

    monkeypatch.setattr(heyoka, "taylor_adaptive", counting)
    return made


def test_a_structure_is_compiled_once(compilations):
    def many():
        for K_s in (2000, 3000, 20000):
            for slope in (None, 4.0, 20.0):
                solve_sliding("heyoka", paper_problem(K_s, slope, duration=0.01, samples=2))
        # One compilation for s = E, and two for s = F + κE: without held axes, and with them.
        assert compilations == [1e-12] * 3
        solve_sliding("heyoka", replace(paper_problem(2000, duration=0.01, samples=2), rtol=1e-9))
        assert compilations[3:] == [1e-9]

    within(120.0, many)


def test_what_is_compiled_does_not_keep_its_runs(monkeypatch):
    kept = []

    class Noted(driver.Driver):
        def __init__(self, *arguments):
            super().__init__(*arguments)
            kept.append(weakref.ref(self))

    monkeypatch.setattr(driven_run, "Driver", Noted)
    solve_sliding("heyoka", replace(PROBLEMS["s = E"](), diagnosed=False))
    gc.collect()
    assert [reference() for reference in kept] == [None]
