"""Following a sliding connector through its modes: smooth flow between switches (Filippov).

Between two switches the vector field is smooth and either engine follows it (a `Flow`). What a
switch leads to is decided here, the same for both.
"""

import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from typing import NamedTuple, Protocol

import numpy as np

from rbstab.integrate.chatter import chatter_energy, stick
from rbstab.integrate.problem import Problem, Progress, Trajectory, trajectory
from rbstab.integrate.status import RunStatus
from rbstab.integrate.switch_log import SwitchLog, SwitchTrace, Transition
from rbstab.integrate.switching import (
    ROUND_OFF,
    Modes,
    Switching,
    connector_of,
    initial_modes,
    instant,
    modes_on_surface,
    system_under,
)
from rbstab.mechanics.attitude import regularity
from rbstab.mechanics.numbers import Array
from rbstab.systems.system import System

STICK_CHECK_EVERY = 32
"""Switches, at least, between two looks at whether axes may stick: a look costs as much as many."""

STICK_CHECK_SHARE = 64
"""Of all switches so far, this part may pass between two looks."""


UNSOLVABLE = (ArithmeticError, ValueError, np.linalg.LinAlgError)
"""Raised where a decision has to solve a small system that holds infinities."""

TRUST = 1e-4
"""Of a state's largest value: two runs this far apart have no digits left to lose."""


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


class Flow(Protocol):
    """Follows the smooth motion of an engine.

    Crossings of s = E may be passed over inside (their mode simply changes sides); a flow that does
    so notes them in the log and returns where that tells it to pause.
    """

    @property
    def steps(self) -> int:
        """Accepted steps so far."""
        ...

    @property
    def evaluations(self) -> int:
        """Evaluations of the rates so far."""
        ...

    def advance(self, start: Reached, end: float, log: SwitchLog) -> Reached:
        """From a state to the next hit that has to be decided, or to a time."""
        ...


class Sample(NamedTuple):
    """One sample of a run with switching."""

    reached: Reached
    counts: tuple[int, ...]
    discarded: float


class Driver:
    """One run through the modes of its connector."""

    def __init__(self, problem: Problem, switching: Switching, flow: Flow) -> None:
        self.problem = problem
        self.switching = switching
        self.flow = flow
        self.log = SwitchLog(switching.stored_switches, switching.switch_limit)
        self.on_position = connector_of(problem.system).rate_weight == 0.0
        self.discarded = 0.0
        self.failure = "its step became too small"
        if self.on_position and switching.stick_energy > 0 and not switching.layered:
            self.log.pause_at = 1
        self.deadline = time.monotonic() + problem.time_limit

    def samples(self) -> Iterator[Sample]:
        """The samples one after the other; the last has a status where the run stopped early."""
        problem, times = self.problem, self.problem.times.tolist()
        y = problem.audited_start()
        modes = initial_modes(problem.system, y[:12], self.switching)
        now = Reached(times[0], y, modes)
        rates = system_under(problem.system, modes).audited_rates(y)
        if not (np.isfinite(y).all() and np.isfinite(rates).all()):
            now = now._replace(status=RunStatus.DIVERGED)
        elif regularity(y[0:3]) <= problem.range_bound:
            now = now._replace(status=RunStatus.RANGE_LEFT)
        yield self._sample(now)
        for end in times[1:] if now.status is None else []:
            while now.time < end and now.status is None:
                now = self._decided(self.flow.advance(now, end, self.log))
            yield self._sample(now)
            if now.status is not None:
                return

    def _sample(self, now: Reached) -> Sample:
        return Sample(now, tuple(self.log.counts), self.discarded)

    def _decided(self, now: Reached) -> Reached:
        if now.status is not None:
            return now
        for hit in now.hits:
            now = self._release(now, hit) if hit.release else self._cross(now, hit)
        if self.log.pause_at is not None and self.log.total >= self.log.pause_at:
            pause = max(STICK_CHECK_EVERY, self.log.total // STICK_CHECK_SHARE)
            self.log.pause_at = min(self.log.total + pause, self.log.limit)
            now = self._stick(now)
        if self.on_position and now.modes.any_held:
            now = self._inside_boxes(now)
        return now._replace(hits=(), status=self._limit_reached())

    def _limit_reached(self) -> RunStatus | None:
        if self.log.total >= self.switching.switch_limit:
            return RunStatus.SWITCH_LIMIT
        if self.flow.steps >= self.problem.step_limit:
            return RunStatus.STEP_LIMIT
        return RunStatus.TIME_LIMIT if time.monotonic() > self.deadline else None

    def _cross(self, now: Reached, hit: Hit) -> Reached:
        modes, axis = now.modes, hit.axis
        self.log.switch(now.time, axis)
        if self.switching.layered:
            leaves = bool(modes.layer[axis])
            mode = hit.direction if leaves else 0.0
            return now._replace(modes=modes.with_axis(axis, mode, layer=float(not leaves)))
        if self.on_position:
            return now._replace(modes=modes.with_axis(axis, hit.direction))
        chosen = self._chosen(now, axis)
        for changed in range(3):
            if chosen.held[changed] != modes.held[changed]:
                what = Transition.STICK if chosen.held[changed] else Transition.RELEASE
                self.log.transitions.append((now.time, changed, what))
        return now._replace(modes=chosen)

    def _chosen(self, now: Reached, axis: int) -> Modes:
        """Filippov's choice for an axis that arrived on s = F + κE, with those held there."""
        on_surface = [a for a in range(3) if a == axis or now.modes.held[a]]
        return modes_on_surface(self.problem.system, now.state[:12], now.modes, on_surface)

    def _release(self, now: Reached, hit: Hit) -> Reached:
        # The force that held the axis is at its bound -K_s σ and stays there.
        self.log.transition(now.time, hit.axis, Transition.RELEASE)
        return now._replace(modes=now.modes.with_axis(hit.axis, -hit.direction))

    def _inside_boxes(self, now: Reached) -> Reached:
        """Releases the held axes whose equivalent force a crossing of another made jump too far."""
        for _ in range(3):
            force = instant(system_under(self.problem.system, now.modes), now.state[:12]).force
            load = np.abs(force) / connector_of(self.problem.system).K_s * now.modes.held
            axis = int(load.argmax())
            if load[axis] <= 1.0 + ROUND_OFF:
                break
            now = self._release(now, Hit(axis, float(np.sign(force[axis])), release=True))
        return now

    def _stick(self, now: Reached) -> Reached:
        system = system_under(self.problem.system, now.modes)
        found = stick(system, now.state, now.modes, self.switching.stick_energy)
        if found is None:
            return now
        self.discarded += found.discarded
        for axis in found.axes:
            self.log.transition(now.time, axis, Transition.STICK)
        return now._replace(state=found.state, modes=found.modes)


def follow(
    problem: Problem, switching: Switching, flow: Flow, progress: Progress | None = None
) -> Trajectory:
    """Follows a problem with a sliding connector to its end, in coordinates W.

    Never raises for what a motion does: that is a status.
    """
    driver = Driver(problem, switching, flow)
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
        detail = f"{_reason(status, driver)} at t = {samples[-1].reached.time:.9g} s"
    rows = [(s.reached.time, s.reached.state) for s in samples]
    systems = tuple(system_under(problem.system, s.reached.modes) for s in samples)
    plain = trajectory(rows, status, detail, flow.steps, flow.evaluations)
    trusted = _trusted_until(driver, plain)
    return replace(plain, switches=_trace(samples, systems, driver.log, trusted), systems=systems)


def _trusted_until(driver: Driver, run: Trajectory) -> float:
    """The last sample up to which the motion does not depend on the last digit of its start.

    A second run starts one unit in the last place away in every state; where the two differ by more
    than `TRUST` of a state's largest value, no program in double precision can say which is right.
    """
    problem = driver.problem
    nudged = replace(problem, start=np.nextafter(problem.start, np.inf))
    shadow = Driver(nudged, driver.switching, driver.flow)
    scale = np.abs(run.states).max(axis=0)
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


def _trace(
    samples: list[Sample], systems: tuple[System, ...], log: SwitchLog, trusted: float
) -> SwitchTrace:
    energies = [
        chatter_energy(system, sample.reached.state[:12])
        for system, sample in zip(systems, samples, strict=True)
    ]
    return SwitchTrace(
        np.array([sample.reached.modes.mode for sample in samples]),
        np.array([sample.counts for sample in samples]),
        np.array(energies),
        np.array([sample.discarded for sample in samples]),
        np.array(log.times),
        np.array(log.axes, dtype=int),
        log.transitions,
        trusted,
    )


def _reason(status: RunStatus, driver: Driver) -> str:
    problem = driver.problem
    return {
        RunStatus.RANGE_LEFT: f"cos θ2 fell to {problem.range_bound:g}",
        RunStatus.DIVERGED: "the state stopped being finite",
        RunStatus.SWITCH_LIMIT: f"stopped after {driver.log.total} switches",
        RunStatus.STEP_LIMIT: f"stopped after {driver.flow.steps} steps",
        RunStatus.TIME_LIMIT: f"stopped after {problem.time_limit:g} s of wall time",
        RunStatus.SOLVER_FAILURE: f"a switch could not be resolved ({driver.failure})",
    }[status]
