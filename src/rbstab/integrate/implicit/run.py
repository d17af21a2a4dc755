"""A run with implicit steps, from sample to sample."""

import math
from collections.abc import Iterator
from itertools import product
from typing import NamedTuple

import numpy as np

from rbstab.integrate.deadline import Deadline
from rbstab.integrate.implicit.axis_modes import Modes, initial_modes, system_for_modes
from rbstab.integrate.implicit.steps import Stepper, StepResult
from rbstab.integrate.problem import Problem
from rbstab.integrate.status import RunStatus
from rbstab.integrate.step_ends import StepEnds
from rbstab.integrate.switch_trace import StickSlip
from rbstab.integrate.switching.switch_log import SwitchLog
from rbstab.mechanics.attitude import regularity
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import BODY, E_OF_W, THETA
from rbstab.systems.connector import connector_of
from rbstab.systems.system import CONTACT_WORK, System

ROUND_OFF = 1e-9
"""Relative tolerance of the bound of an equivalent force, and of the number of steps."""

SIDES = [(a, b, c) for a, b, c in product((1.0, -1.0, 0.0), repeat=3)]
"""Every combination of the sides of three axes; 0 for a held axis."""


def _modes_by_distance(mode: tuple[float, float, float]) -> list[Modes]:
    """Return all modes, ordered by the number of axes on which they differ from the given mode."""
    ordered = sorted(SIDES, key=lambda sides: int(np.sum(np.array(sides) != mode)))
    return [
        Modes(sides, held=(float(sides[0] == 0), float(sides[1] == 0), float(sides[2] == 0)))
        for sides in ordered
    ]


MODES_BY_DISTANCE = {sides: _modes_by_distance(sides) for sides in SIDES}
"""The order in which modes are tried, for each mode of the previous step."""


class RunState(NamedTuple):
    """The state of a run: time, audited state and modes.

    status is set if the run ends here; reason is why, as text, if a step failed.
    """

    time: float
    state: Array
    modes: Modes
    status: RunStatus | None = None
    reason: str = ""


class Sample(NamedTuple):
    """One sample of a run with switching."""

    run_state: RunState
    counts: tuple[int, ...]
    discarded: float


def initial_state(problem: Problem) -> RunState:
    """Return the state at the first sample, with a status if the run cannot start."""
    y = problem.audited_start()
    modes = initial_modes(problem.system, y[BODY])
    rates = system_for_modes(problem.system, modes).audited_rates(y)
    status = None
    if not (np.isfinite(y).all() and np.isfinite(rates).all()):
        status = RunStatus.DIVERGED
    elif regularity(y[THETA]) <= problem.range_bound:
        status = RunStatus.RANGE_LEFT
    return RunState(float(problem.times[0]), y, modes, status=status)


class ImplicitRun:
    """One run with implicit steps of a problem.

    The steps between two samples are equal, and at most `Switching.step` (to round-off).

    Args:
        problem: The problem; its `switching` has a step.
        stepper: Makes one step in given modes.
        deadline: The deadline of the run.
    """

    def __init__(self, problem: Problem, stepper: Stepper, deadline: Deadline) -> None:
        assert problem.switching is not None
        self.problem, self.switching, self.stepper = problem, problem.switching, stepper
        self.connector = connector_of(problem.system)
        self.K_s = self.connector.K_s.tolist()
        self.on_position = self.connector.rate_weight == 0.0
        self.log = SwitchLog(self.switching.stored_switches, self.switching.switch_limit)
        self.steps = self.evaluations = 0
        self.deadline = deadline
        self.ends = StepEnds()
        self._systems: dict[Modes, System] = {}

    def system_of(self, modes: Modes) -> System:
        """Return the system in some modes; what is made for it serves all steps in them."""
        if modes not in self._systems:
            self._systems[modes] = system_for_modes(self.problem.system, modes)
        return self._systems[modes]

    def samples(self) -> Iterator[Sample]:
        """Yield the samples in order; the last has a status if the run stopped early."""
        current = initial_state(self.problem)
        self.modes = current.modes
        self.ends.add(current.time, current.state, self.system_of(self.modes))
        initial_energy = self._connector_energy(current.state)
        yield Sample(current, tuple(self.log.counts), 0.0)
        for end in self.problem.times[1:].tolist() if current.status is None else []:
            current = self._step_to(current, end)
            # The connector received this energy, but neither stores nor returned it: the implicit
            # steps dissipate it.
            discarded = (
                initial_energy
                - self._connector_energy(current.state)
                - float(current.state[CONTACT_WORK])
            )
            yield Sample(current, tuple(self.log.counts), discarded if self.on_position else 0.0)
            if current.status is not None:
                return

    def _connector_energy(self, y: Array) -> float:
        return float(self.connector.K_s @ np.abs(y[E_OF_W]))

    def _step_to(self, current: RunState, end: float) -> RunState:
        """Make equal steps until the next sample, or until a step ends the run."""
        begin = current.time
        count = max(1, math.ceil((end - begin) / self.switching.step * (1.0 - ROUND_OFF)))
        h = (end - begin) / count
        for k in range(1, count + 1):
            modes, after = self._consistent_step(current.state, h)
            self.steps += 1
            if not np.isfinite(after.state).all():
                return current._replace(status=RunStatus.DIVERGED)
            time_reached = end if k == count else begin + k * h
            self._record_switches(time_reached, modes)
            self.ends.add(time_reached, after.state, self.system_of(modes))
            status = self._stop_status(after.state)
            current = RunState(time_reached, after.state, current.modes, status=status)
            if k == count or status is not None:
                break
        # The stored mode of a held axis is σ = -Λ/K_s of the last step.
        share = np.clip(-after.force / self.connector.K_s, -1.0, 1.0)
        shares = np.where(np.array(self.modes.held) == 1.0, share, self.modes.mode)
        return current._replace(modes=Modes((shares[0], shares[1], shares[2])))

    def _consistent_step(self, y: Array, h: float) -> tuple[Modes, StepResult]:
        """Make the step in the modes for which Λ ∈ -K_s Sgn(s⁺); return these modes and the step.

        Such modes exist, because the mobility is positive definite. The modes that differ least
        from the last ones are tried first.
        """
        # A rough factor from errors of s⁺ to newtons, to compare violations of both kinds.
        weight = self.connector.rate_weight + self.connector.slope * h
        scale = self.problem.system.body.mass / (h * weight)
        best: tuple[float, Modes, StepResult] | None = None
        for modes in MODES_BY_DISTANCE[self.modes.mode]:
            after = self.stepper(y, modes, h)
            self.evaluations += 1
            violation = self._violation(modes, after, scale)
            if best is None or violation < best[0]:
                best = violation, modes, after
            if violation <= ROUND_OFF:
                break
        assert best is not None
        return best[1], best[2]

    def _violation(self, modes: Modes, after: StepResult, scale: float) -> float:
        """Return the largest violation of Λ ∈ -K_s Sgn(s⁺) of any axis, relative to K_s."""
        surface, force = after.surface.tolist(), after.force.tolist()
        worst = 0.0
        for side, s, f, K_s in zip(modes.mode, surface, force, self.K_s, strict=True):
            violation = abs(f) / K_s - 1.0 if side == 0.0 else -side * s * scale / K_s
            if not violation <= worst:
                worst = violation
        return worst

    def _record_switches(self, time_reached: float, modes: Modes) -> None:
        for axis, (old, new) in enumerate(zip(self.modes.mode, modes.mode, strict=True)):
            if new == old:
                continue
            self.log.add_switch(time_reached, axis)
            if 0.0 in (old, new):
                kind = StickSlip.STICK if new == 0.0 else StickSlip.RELEASE
                self.log.add_transition(time_reached, axis, kind)
        self.modes = modes

    def _stop_status(self, y: Array) -> RunStatus | None:
        if regularity(y[THETA]) <= self.problem.range_bound:
            return RunStatus.RANGE_LEFT
        if self.log.total >= self.switching.switch_limit:
            return RunStatus.SWITCH_LIMIT
        if self.steps >= self.problem.step_limit:
            return RunStatus.STEP_LIMIT
        return RunStatus.TIME_LIMIT if self.deadline.expired() else None
