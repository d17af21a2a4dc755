"""A second run finds how far a run can be trusted; it is optional and changes nothing."""

from dataclasses import replace

import numpy as np
import pytest
from support.problems import each_engine
from support.sliding import paper_problem, solve_sliding

from rbstab.integrate.run import Run
from rbstab.integrate.status import RunStatus

LAWS = {"s = E": {}, "implicit": {"step": 1e-3}}


@each_engine
@pytest.mark.parametrize("law", LAWS)
def test_the_motion_is_the_same_without_it(engine, law, monkeypatch):
    problem = paper_problem(2000, duration=0.1, samples=3, **LAWS[law])
    diagnosed = solve_sliding(engine, problem)
    starts = []

    def noted(of):
        def call(*arguments):
            starts.append(arguments)
            return of(*arguments)

        return call

    monkeypatch.setattr(Run, "result", noted(Run.result))
    run = solve_sliding(engine, replace(problem, diagnosed=False))
    assert len(starts) == 1
    assert run.states.tobytes() == diagnosed.states.tobytes()
    assert run.lyapunov_change.tobytes() == diagnosed.lyapunov_change.tobytes()
    assert (run.steps, run.evaluations) == (diagnosed.steps, diagnosed.evaluations)
    assert run.switches.counts.tolist() == diagnosed.switches.counts.tolist()
    assert run.switches.switch_times.tobytes() == diagnosed.switches.switch_times.tobytes()
    assert run.trusted_until is None
    assert run.switches.chatter_energy.shape == (3,)
    assert np.isnan(run.switches.chatter_energy).all()
    assert diagnosed.trusted_until == problem.times[-1]
    assert np.isfinite(diagnosed.switches.chatter_energy).all()


@each_engine
def test_the_steps_of_a_run_are_not_counted_against_the_second_one(engine):
    problem = paper_problem(2000, duration=0.2, samples=5)
    free = solve_sliding(engine, problem)
    assert free.trusted_until == 0.2
    tight = solve_sliding(engine, replace(problem, step_limit=free.steps + 5))
    assert tight.status is RunStatus.COMPLETED
    assert tight.trusted_until == 0.2
