"""Following a sliding connector sample by sample, and how far the result can be trusted.

How a motion goes from one sample to the next is a `Driver`'s: exactly, switch by switch
(`filippov`), or by implicit steps (`implicit`).
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
from rbstab.integrate.switching.modes import Modes, initial_modes, system_under
from rbstab.integrate.switching.switch_log import SwitchLog
from rbstab.mechanics.attitude import regularity
from rbstab.mechanics.numbers import Array
from rbstab.systems.system import System

UNSOLVABLE = (ArithmeticError, ValueError, np.linalg.LinAlgError)
"""Raised where a decision has to solve a small system that holds infinities."""

TRUST = 1e-4
"""Of a vector's largest entry: two runs this far apart have no digits left to lose."""

NOTHING = 1e-9
"""rad, rad/s, m, m/s: a vector that never is larger is only round-off."""


class Hit(NamedTuple):
    """An event that ends a mode: an axis reaches a threshold of s, or of its equivalent force.

    direction is 1 where the quantity was rising, else -1; release tells a bound of the force.
    """

    axis: int
    direction: float
    release: bool


class Reached(NamedTuple):
    """Where a flow ended: time, audited state, modes, and the hits there (none at its end).

    status is set where the run ends here.
    """

    time: float
    state: Array
    modes: Modes
    hits: tuple[Hit, ...] = ()
    status: RunStatus | None = None


class Sample(NamedTuple):
    """One sample of a run with switching."""

    reached: Reached
    counts: tuple[int, ...]
    discarded: float


class Driver(Protocol):
    """One run of a problem."""

    log: SwitchLog
    failure: str
    """Why a switch could not be resolved, where that ended the run."""

    @property
    def steps(self) -> int:
        """Accepted steps so far."""
        ...

    @property
    def evaluations(self) -> int:
        """Evaluations of the rates so far."""
        ...

    def samples(self) -> Iterator[Sample]:
        """The samples one after the other; the last has a status where the run stopped early."""
        ...


def at_start(problem: Problem, switching: Switching) -> Reached:
    """The first sample, with a status where the motion cannot even begin."""
    y = problem.audited_start()
    modes = initial_modes(problem.system, y[:12], switching)
    rates = system_under(problem.system, modes).audited_rates(y)
    status = None
    if not (np.isfinite(y).all() and np.isfinite(rates).all()):
        status = RunStatus.DIVERGED
    elif regularity(y[0:3]) <= problem.range_bound:
        status = RunStatus.RANGE_LEFT
    return Reached(float(problem.times[0]), y, modes, status=status)


def follow(
    problem: Problem, make: Callable[[Problem], Driver], progress: Progress | None = None
) -> Trajectory:
    """Follows a problem with a sliding connector to its end, in coordinates W.

    Never raises for what a motion does: that is a status.

    Args:
        problem: The problem.
        make: Makes the follower of a problem; it is asked twice of one that is to be diagnosed (see
            `_trusted_until`).
        progress: Called with the time of every sample.
    """
    driver = make(problem)
    samples: list[Sample] = []
    try:
        for sample in driver.samples():
            samples.append(sample)
            if progress is not None:
                progress(sample.reached.time)
    except UNSOLVABLE as error:
        last = samples[-1].reached._replace(status=RunStatus.SOLVER_FAILURE)
        samples[-1] = samples[-1]._replace(reached=last)
        driver.failure = str(error)
    status = samples[-1].reached.status or RunStatus.COMPLETED
    detail = ""
    if status is not RunStatus.COMPLETED:
        detail = f"{_reason(status, problem, driver)} at t = {samples[-1].reached.time:.9g} s"
    rows = [(s.reached.time, s.reached.state) for s in samples]
    systems = tuple(system_under(problem.system, s.reached.modes) for s in samples)
    plain = trajectory(rows, status, detail, driver.steps, driver.evaluations)
    switches = _trace(samples, driver.log)
    if problem.diagnosed:
        switches = switches._replace(
            chatter_energy=_chatter_energies(samples, systems),
            trusted_until=_trusted_until(make, problem, plain),
        )
    return replace(plain, switches=switches, systems=systems)


def _trusted_until(make: Callable[[Problem], Driver], problem: Problem, run: Trajectory) -> float:
    """The last sample up to which the motion does not depend on the last digit of its start.

    A second run starts one unit in the last place away in every state; where the two differ by more
    than `TRUST` of the largest value of Θ, Ω, E or F, no program in double precision can say which
    is right.
    """
    shadow = make(replace(problem, start=np.nextafter(problem.start, np.inf)))
    # Axis by axis a held point would be measured by its own round-off.
    largest = np.abs(run.states).reshape(len(run.times), -1, 3).max(axis=(0, 2))
    scale = np.repeat(np.maximum(largest, NOTHING), 3)
    trusted = float(run.times[0])
    # Where the second run fails, trust ends too.
    with suppress(*UNSOLVABLE):
        for row, sample in enumerate(shadow.samples()):
            if row >= len(run.times) or sample.reached.time != run.times[row]:
                break
            apart = np.abs(sample.reached.state[: len(scale)] - run.states[row])
            if not (apart <= TRUST * scale).all():
                break
            trusted = sample.reached.time
    return trusted


def _chatter_energies(samples: list[Sample], systems: tuple[System, ...]) -> Array:
    pairs = zip(systems, samples, strict=True)
    return np.array([chatter_energy(system, one.reached.state[:12]) for system, one in pairs])


def _trace(samples: list[Sample], log: SwitchLog) -> SwitchTrace:
    """The switching of a run that is not diagnosed."""
    return SwitchTrace(
        # An axis whose force is inside its bounds is on neither side.
        modes=np.trunc([sample.reached.modes.mode for sample in samples]),
        counts=np.array([sample.counts for sample in samples]),
        chatter_energy=np.full(len(samples), np.nan),
        discarded_energy=np.array([sample.discarded for sample in samples]),
        switch_times=np.array(log.times),
        switch_axes=np.array(log.axes, dtype=int),
        transitions=log.transitions,
        trusted_until=np.nan,
    )


def _reason(status: RunStatus, problem: Problem, driver: Driver) -> str:
    return {
        RunStatus.RANGE_LEFT: f"cos θ2 fell to {problem.range_bound:g}",
        RunStatus.DIVERGED: "the state stopped being finite",
        RunStatus.SWITCH_LIMIT: f"stopped after {driver.log.total} switches",
        RunStatus.STEP_LIMIT: f"stopped after {driver.steps} steps",
        RunStatus.TIME_LIMIT: f"stopped after {problem.time_limit:g} s of wall time",
        RunStatus.SOLVER_FAILURE: f"a switch could not be resolved ({driver.failure})",
    }[status]
