"""Integration of a system with a sliding connector, and the time up to which it is reproducible.

A `Driver` integrates from one sample to the next: it locates each switch (`filippov`), or makes
implicit steps (`implicit`).
"""

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import replace
from typing import NamedTuple, Protocol

import numpy as np

from rbstab.integrate.problem import Problem, Progress, Switching, Trajectory, trajectory
from rbstab.integrate.status import RunStatus
from rbstab.integrate.switch_trace import SwitchTrace
from rbstab.integrate.switching.chatter import chatter_energy
from rbstab.integrate.switching.modes import Modes, initial_modes, system_for_modes
from rbstab.integrate.switching.switch_log import SwitchLog
from rbstab.mechanics.attitude import regularity
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import BODY, THETA
from rbstab.systems.system import System

NUMERICAL_ERRORS = (ArithmeticError, ValueError, np.linalg.LinAlgError)
"""Exceptions raised if a small linear system contains infinities."""

TRUST_TOLERANCE = 1e-4
"""If two runs differ by more than this times the largest entry, they are not reproducible."""

NEGLIGIBLE = 1e-9
"""rad, rad/s, m, m/s: a vector that never exceeds this contains only round-off."""


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

    There are no events if the flow ended at its end time. status is set if the run ends here.
    """

    time: float
    state: Array
    modes: Modes
    events: tuple[SwitchEvent, ...] = ()
    status: RunStatus | None = None


class Sample(NamedTuple):
    """One sample of a run with switching."""

    driver_state: DriverState
    counts: tuple[int, ...]
    discarded: float


class Driver(Protocol):
    """The interface of a driver: one run of a problem."""

    log: SwitchLog
    failure: str
    """The reason, as text, if the run ended because a switch could not be resolved."""

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
    problem: Problem, make_driver: Callable[[Problem], Driver], progress: Progress | None = None
) -> Trajectory:
    """Integrate a problem with a sliding connector, in coordinates W.

    A failed integration returns a status and raises no exception.

    Args:
        problem: The problem.
        make_driver: Makes the driver of a problem. It is called twice if the problem is diagnosed
            (see `_trusted_until`).
        progress: Called with the time of each sample.
    """
    driver = make_driver(problem)
    samples: list[Sample] = []
    try:
        for sample in driver.samples():
            samples.append(sample)
            if progress is not None:
                progress(sample.driver_state.time)
    except NUMERICAL_ERRORS as error:
        last = samples[-1].driver_state._replace(status=RunStatus.SOLVER_FAILURE)
        samples[-1] = samples[-1]._replace(driver_state=last)
        driver.failure = str(error)
    status = samples[-1].driver_state.status or RunStatus.COMPLETED
    detail = ""
    if status is not RunStatus.COMPLETED:
        detail = (
            f"{_stop_reason(status, problem, driver)} at t = {samples[-1].driver_state.time:.9g} s"
        )
    rows = [(s.driver_state.time, s.driver_state.state) for s in samples]
    systems = tuple(system_for_modes(problem.system, s.driver_state.modes) for s in samples)
    result = trajectory(rows, status, detail, driver.steps, driver.evaluations)
    switches = _switch_trace(samples, driver.log)
    if problem.diagnosed:
        switches = switches._replace(
            chatter_energy=_chatter_energies(samples, systems),
            trusted_until=_trusted_until(make_driver, problem, result),
        )
    return replace(result, switches=switches, systems=systems)


def _trusted_until(
    make_driver: Callable[[Problem], Driver], problem: Problem, run: Trajectory
) -> float:
    """Return the time of the last sample that does not depend on the last digit of the start.

    A second run starts one unit in the last place away in every state. The trusted time ends when
    the two runs differ by more than `TRUST_TOLERANCE` times the largest value of Θ, Ω, E or F.
    After that, both runs are equally valid in double precision.
    """
    perturbed = make_driver(replace(problem, start=np.nextafter(problem.start, np.inf)))
    # The largest value is taken over all axes, because a held axis contains only round-off.
    largest_values = np.abs(run.states).reshape(len(run.times), -1, 3).max(axis=(0, 2))
    scale = np.repeat(np.maximum(largest_values, NEGLIGIBLE), 3)
    trusted = float(run.times[0])
    # A failure of the second run also ends the trusted time.
    with suppress(*NUMERICAL_ERRORS):
        for row, sample in enumerate(perturbed.samples()):
            if row >= len(run.times) or sample.driver_state.time != run.times[row]:
                break
            difference = np.abs(sample.driver_state.state[: len(scale)] - run.states[row])
            if not (difference <= TRUST_TOLERANCE * scale).all():
                break
            trusted = sample.driver_state.time
    return trusted


def _chatter_energies(samples: list[Sample], systems: tuple[System, ...]) -> Array:
    pairs = zip(systems, samples, strict=True)
    return np.array(
        [chatter_energy(system, sample.driver_state.state[BODY]) for system, sample in pairs]
    )


def _switch_trace(samples: list[Sample], log: SwitchLog) -> SwitchTrace:
    """Return the switching of a run, without its diagnosis."""
    return SwitchTrace(
        # `ImplicitDriver` stores a fraction for an axis held on the surface; its mode is 0.
        modes=np.trunc([sample.driver_state.modes.mode for sample in samples]),
        counts=np.array([sample.counts for sample in samples]),
        chatter_energy=np.full(len(samples), np.nan),
        discarded_energy=np.array([sample.discarded for sample in samples]),
        switch_times=np.array(log.times),
        switch_axes=np.array(log.axes, dtype=int),
        transitions=log.transitions,
        trusted_until=np.nan,
    )


def _stop_reason(status: RunStatus, problem: Problem, driver: Driver) -> str:
    return {
        RunStatus.RANGE_LEFT: f"cos θ2 fell to {problem.range_bound:g}",
        RunStatus.DIVERGED: "the state stopped being finite",
        RunStatus.SWITCH_LIMIT: f"stopped after {driver.log.total} switches",
        RunStatus.STEP_LIMIT: f"stopped after {driver.steps} steps",
        RunStatus.TIME_LIMIT: f"stopped after {problem.time_limit:g} s of wall time",
        RunStatus.SOLVER_FAILURE: f"a switch could not be resolved ({driver.failure})",
    }[status]
