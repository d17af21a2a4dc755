"""Integration of a system with a sliding connector, and the time up to which it is reproducible.

A `Driver` integrates from one sample to the next: it locates each switch (`filippov`), or makes
implicit steps (`implicit`).
"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import NamedTuple, Protocol

import numpy as np

from rbstab.integrate.deadline import Deadline
from rbstab.integrate.problem import Problem, Progress, Switching, Trajectory, trajectory
from rbstab.integrate.status import RunStatus
from rbstab.integrate.switch_trace import SwitchTrace
from rbstab.integrate.switching.chatter import chatter_energy
from rbstab.integrate.switching.modes import Modes, initial_modes, system_for_modes
from rbstab.integrate.switching.switch_log import SwitchLog
from rbstab.integrate.switching.trust import (
    NUMERICAL_ERRORS,
    Sampled,
    perturbed_start,
    trusted_until,
)
from rbstab.mechanics.attitude import regularity
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import BODY, THETA
from rbstab.systems.system import System


class SwitchEvent(NamedTuple):
    """An event that ends a mode: s or the equivalent force of an axis reaches a threshold.

    direction is 1 if the quantity was rising, else -1. release is True if the quantity is the
    force, False if it is s.
    """

    axis: int
    direction: float
    release: bool


class DriverState(NamedTuple):
    """The state of a run at the end of a flow: time, audited state, modes and events.

    There are no events if the flow ended at its end time or at a limit. status is set if the run
    ends here; reason is why, as text, if a switch could not be resolved.
    """

    time: float
    state: Array
    modes: Modes
    events: tuple[SwitchEvent, ...] = ()
    status: RunStatus | None = None
    reason: str = ""


class Sample(NamedTuple):
    """One sample of a run with switching."""

    driver_state: DriverState
    counts: tuple[int, ...]
    discarded: float


class Driver(Protocol):
    """The interface of a driver: one run of a problem."""

    log: SwitchLog

    @property
    def steps(self) -> int:
        """Accepted steps so far."""
        ...

    @property
    def evaluations(self) -> int:
        """Evaluations of the rates so far."""
        ...

    def samples(self) -> Iterator[Sample]:
        """Yield the samples in order; the last has a status if the run stopped early."""
        ...


def initial_driver_state(problem: Problem, switching: Switching) -> DriverState:
    """Return the state at the first sample, with a status if the run cannot start."""
    y = problem.audited_start()
    modes = initial_modes(problem.system, y[BODY], switching)
    rates = system_for_modes(problem.system, modes).audited_rates(y)
    status = None
    if not (np.isfinite(y).all() and np.isfinite(rates).all()):
        status = RunStatus.DIVERGED
    elif regularity(y[THETA]) <= problem.range_bound:
        status = RunStatus.RANGE_LEFT
    return DriverState(float(problem.times[0]), y, modes, status=status)


def drive(
    problem: Problem,
    make_driver: Callable[[Problem], Driver],
    progress: Progress | None = None,
    deadline: Deadline | None = None,
) -> Trajectory:
    """Integrate a problem with a sliding connector, in coordinates W.

    A failed integration returns a status and raises no exception.

    Args:
        problem: The problem.
        make_driver: Makes the driver of a problem. It is called twice if the problem is diagnosed
            (see `trusted_until`).
        progress: Called with the time of each sample.
        deadline: The deadline of both runs; the drivers check it. Default one that starts now.
    """
    deadline = deadline or Deadline(problem.time_limit)
    driver = make_driver(problem)
    samples: list[Sample] = []
    systems: list[System] = []
    known: dict[Modes, System] = {}
    chatter_energies: list[float] = []
    try:
        for sample in driver.samples():
            state = sample.driver_state
            # Samples in the same modes share one system: what is made for it serves all of them.
            if state.modes not in known:
                known[state.modes] = system_for_modes(problem.system, state.modes)
            system = known[state.modes]
            systems.append(system)
            chatter_energies.append(
                chatter_energy(system, state.state[BODY]) if problem.diagnosed else np.nan
            )
            samples.append(sample)
            deadline.samples = len(samples)
            if progress is not None:
                progress(state.time)
    except NUMERICAL_ERRORS as error:
        failed = samples[-1].driver_state._replace(
            status=RunStatus.SOLVER_FAILURE, reason=str(error)
        )
        samples[-1] = samples[-1]._replace(driver_state=failed)
    last = samples[-1].driver_state
    status = last.status or RunStatus.COMPLETED
    if status is RunStatus.TIME_LIMIT and last.time == problem.times[-1]:
        # A limit reached in the last step does not count.
        status = RunStatus.COMPLETED
    detail = ""
    if status is not RunStatus.COMPLETED:
        reason = _stop_reason(status, problem, driver, deadline, last.reason)
        detail = f"{reason} at t = {last.time:.9g} s"
    rows = [(s.driver_state.time, s.driver_state.state) for s in samples]
    result = trajectory(problem, rows, status, detail, driver.steps, driver.evaluations)
    switches = _switch_trace(samples, chatter_energies[: len(samples)], driver.log)
    if problem.diagnosed:
        switches = switches._replace(
            trusted_until=trusted_until(result, _second_run(make_driver, problem))
        )
    return replace(result, switches=switches, systems=tuple(systems[: len(samples)]))


def _second_run(make_driver: Callable[[Problem], Driver], problem: Problem) -> Iterator[Sampled]:
    """Yield the samples of the second run that finds how far the first can be trusted."""
    perturbed = make_driver(replace(problem, start=perturbed_start(problem)))
    for sample in perturbed.samples():
        state = sample.driver_state
        yield state.time, state.state, state.status


def _switch_trace(
    samples: list[Sample], chatter_energies: list[float], log: SwitchLog
) -> SwitchTrace:
    """Return the switching of a run, without `trusted_until`."""
    return SwitchTrace(
        # `ImplicitDriver` stores a fraction for an axis held on the surface; its mode is 0.
        modes=np.trunc([sample.driver_state.modes.mode for sample in samples]),
        counts=np.array([sample.counts for sample in samples]),
        chatter_energy=np.array(chatter_energies),
        discarded_energy=np.array([sample.discarded for sample in samples]),
        switch_times=np.array(log.times),
        switch_axes=np.array(log.axes, dtype=int),
        transitions=log.transitions,
        trusted_until=np.nan,
    )


def _stop_reason(
    status: RunStatus, problem: Problem, driver: Driver, deadline: Deadline, failure: str
) -> str:
    return {
        RunStatus.RANGE_LEFT: f"cos θ2 fell to {problem.range_bound:g}",
        RunStatus.DIVERGED: "the state stopped being finite",
        RunStatus.SWITCH_LIMIT: f"stopped after {driver.log.total} switches",
        RunStatus.STEP_LIMIT: f"stopped after {driver.steps} steps",
        RunStatus.TIME_LIMIT: deadline.reason,
        RunStatus.SOLVER_FAILURE: f"a switch could not be resolved ({failure})",
    }[status]
