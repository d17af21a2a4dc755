"""How far a run can be trusted is found by a second run, where it is asked for."""

from dataclasses import replace

import numpy as np
import pytest
from support.sliding import follow, paper_problem

from rbstab.integrate.status import RunStatus
from rbstab.integrate.switching import driver as following

ENGINES = ["heyoka", "scipy"]

LAWS = {"s = E": {}, "implicit": {"step": 1e-3}}


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("law", LAWS)
def test_the_motion_is_the_same_without_it(engine, law, monkeypatch):
    problem = paper_problem(2000, duration=0.1, samples=3, **LAWS[law])
    told = follow(engine, problem)
    starts = []
    at_start = following.at_start
    for module in ("filippov", "implicit"):
        monkeypatch.setattr(
            f"rbstab.integrate.switching.{module}.at_start",
            lambda problem, switching: starts.append(problem) or at_start(problem, switching),
        )
    run = follow(engine, replace(problem, diagnosed=False))
    assert len(starts) == 1
    assert run.states.tobytes() == told.states.tobytes()
    assert run.lyapunov_change.tobytes() == told.lyapunov_change.tobytes()
    assert (run.steps, run.evaluations) == (told.steps, told.evaluations)
    assert run.switches.counts.tolist() == told.switches.counts.tolist()
    assert run.switches.switch_times.tobytes() == told.switches.switch_times.tobytes()
    assert np.isnan(run.switches.trusted_until)
    assert run.switches.chatter_energy.shape == (3,)
    assert np.isnan(run.switches.chatter_energy).all()
    assert told.switches.trusted_until == problem.times[-1]
    assert np.isfinite(told.switches.chatter_energy).all()


@pytest.mark.parametrize("engine", ENGINES)
def test_the_steps_of_a_run_are_not_counted_against_the_second_one(engine):
    problem = paper_problem(2000, duration=0.2, samples=5)
    free = follow(engine, problem)
    assert free.switches.trusted_until == 0.2
    tight = follow(engine, replace(problem, step_limit=free.steps + 5))
    assert tight.status is RunStatus.COMPLETED
    assert tight.switches.trusted_until == 0.2
