"""Trajectories by implicit steps, and the time up to which they are reproducible."""

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from rbstab.integrate.deadline import Deadline
from rbstab.integrate.implicit.run import ImplicitRun, Sample
from rbstab.integrate.implicit.steps import Stepper
from rbstab.integrate.problem import Problem, Progress, Trajectory, trajectory
from rbstab.integrate.status import RunStatus
from rbstab.integrate.switch_trace import SwitchTrace
from rbstab.integrate.switching.chatter import Chatter
from rbstab.integrate.switching.switch_log import SwitchLog
from rbstab.integrate.switching.trust import (
    NUMERICAL_ERRORS,
    Sampled,
    perturbed_start,
    trusted_until,
)
from rbstab.systems.system import System


def integrate(
    problem: Problem,
    make_stepper: Callable[[], Stepper],
    progress: Progress | None,
    deadline: Deadline,
) -> Trajectory:
    """Integrate a problem with a sliding connector by implicit steps, in coordinates W.

    A failed integration returns a status and raises no exception.

    Args:
        problem: The problem.
        make_stepper: Returns the engine's stepper.
        progress: Called with the time of each sample.
        deadline: The deadline of the run, and of the second run that diagnoses it.
    """
    stepper = make_stepper()
    run = ImplicitRun(problem, stepper, deadline)
    samples: list[Sample] = []
    systems: list[System] = []
    chatter = Chatter(problem.system)
    chatter_energies: list[float] = []
    try:
        for sample in run.samples():
            state = sample.run_state
            systems.append(run.system_of(state.modes))
            chatter_energies.append(chatter.energy(state.state) if problem.diagnosed else np.nan)
            samples.append(sample)
            deadline.samples = len(samples)
            if progress is not None:
                progress(state.time)
    except NUMERICAL_ERRORS as error:
        failed = samples[-1].run_state._replace(status=RunStatus.SOLVER_FAILURE, reason=str(error))
        samples[-1] = samples[-1]._replace(run_state=failed)
    last = samples[-1].run_state
    status = last.status or RunStatus.COMPLETED
    if status is RunStatus.TIME_LIMIT and last.time == problem.times[-1]:
        # A limit reached in the last step does not count.
        status = RunStatus.COMPLETED
    detail = ""
    if status is not RunStatus.COMPLETED:
        reason = _stop_reason(status, problem, run, deadline, last.reason)
        detail = f"{reason} at t = {last.time:.9g} s"
    rows = [(s.run_state.time, s.run_state.state) for s in samples]
    result = trajectory(problem, rows, status, detail, run.steps, run.evaluations, ends=run.ends)
    switches = _switch_trace(samples, chatter_energies[: len(samples)], run.log)
    if problem.diagnosed:
        switches = switches._replace(
            trusted_until=trusted_until(result, _second_run(problem, stepper, deadline))
        )
    return replace(result, switches=switches, systems=tuple(systems[: len(samples)]))


def _second_run(problem: Problem, stepper: Stepper, deadline: Deadline) -> Iterator[Sampled]:
    """Yield the samples of the second run that finds how far the first can be trusted."""
    perturbed = ImplicitRun(replace(problem, start=perturbed_start(problem)), stepper, deadline)
    for sample in perturbed.samples():
        state = sample.run_state
        yield state.time, state.state, state.status


def _switch_trace(
    samples: list[Sample], chatter_energies: list[float], log: SwitchLog
) -> SwitchTrace:
    """Return the switching of a run, without `trusted_until`."""
    return SwitchTrace(
        # `ImplicitRun` stores a fraction for an axis held on the surface; its mode is 0.
        modes=np.trunc([sample.run_state.modes.mode for sample in samples]),
        counts=np.array([sample.counts for sample in samples]),
        chatter_energy=np.array(chatter_energies),
        discarded_energy=np.array([sample.discarded for sample in samples]),
        switch_times=np.array(log.times),
        switch_axes=np.array(log.axes, dtype=int),
        transitions=log.transitions,
        trusted_until=np.nan,
    )


def _stop_reason(
    status: RunStatus, problem: Problem, run: ImplicitRun, deadline: Deadline, failure: str
) -> str:
    return {
        RunStatus.RANGE_LEFT: f"cos θ2 fell to {problem.range_bound:g}",
        RunStatus.DIVERGED: "the state stopped being finite",
        RunStatus.SWITCH_LIMIT: f"stopped after {run.log.total} switches",
        RunStatus.STEP_LIMIT: f"stopped after {run.steps} steps",
        RunStatus.TIME_LIMIT: deadline.reason,
        RunStatus.SOLVER_FAILURE: f"a step failed ({failure})",
    }[status]
