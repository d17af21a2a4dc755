"""The input and output of an engine: a problem and its trajectory."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np

from rbstab.integrate.deadline import Deadline
from rbstab.integrate.status import RunStatus
from rbstab.integrate.step_ends import StepEnds
from rbstab.integrate.traces import ImpactTrace, SwitchTrace
from rbstab.mechanics.numbers import Array
from rbstab.systems.schedule import NO_LEGS, Schedule
from rbstab.systems.system import System

Progress = Callable[[float], None]
"""Called after every step with the current time, s."""


@dataclass(frozen=True)
class Switching:
    """The rules by which the modes of a sliding connector change.

    Args:
        layered: Whether a boundary layer replaces the sign.
        step: The step of the implicit law, s; 0 selects the exact law.
        stick_energy: On s = E an axis may stick when the chatter energy is below this, J; 0: never.
        switch_limit: The run stops after this many switches.
        stored_switches: How many switches are stored with time and axis; later ones are only
            counted.
    """

    layered: bool = False
    step: float = 0.0
    stick_energy: float = 0.0
    switch_limit: int = 10_000_000
    stored_switches: int = 100_000

    @property
    def sticks(self) -> bool:
        """Whether chattering axes may stick."""
        return self.stick_energy > 0 and not self.layered and self.step == 0


@dataclass(frozen=True, eq=False)
class Problem:
    """An initial value problem with sample times, tolerances and limits.

    Args:
        system: The equations.
        start: The state vector at the first sample, shape (system.size,).
        times: The samples, shape (samples,), s, ascending.
        rtol: Relative tolerance of a step.
        atol: Absolute tolerance of a step, in the states' units (scipy only).
        method: The name of SciPy's integrator (scipy only).
        range_bound: The run stops when cos θ2 falls to this value (eq. 5).
        project: Whether the state is projected onto the submanifold E = F = 0 after every step
            (eq. 16).
        step_limit: The largest number of steps.
        time_limit: The longest wall time, s; see `Deadline`.
        switching: The rules for a sliding connector, or None if the system has none.
        diagnosed: Whether the run of a sliding connector reports its chatter energy and
            `trusted_until`, which needs a second run. So does that of a sliding tie or a stop.
        exact: Builds the system and the start from the numbers of the config, in the kind of number
            to which a function converts doubles. None: the problem is not that of a config.
        schedule: The legs of the inputs that are made of legs.
        quaternion: Whether engines integrate a quaternion in place of Θ (`InQuaternions`). The
            states of the problem and of its trajectory have Θ all the same.
    """

    system: System
    start: Array
    times: Array
    rtol: float
    atol: float
    method: str
    range_bound: float
    project: bool
    step_limit: int
    time_limit: float
    switching: Switching | None = None
    diagnosed: bool = True
    exact: Callable[[Callable[[Array], Array]], tuple[System, Array]] | None = None
    schedule: Schedule = NO_LEGS
    quaternion: bool = False

    def audited_start(self) -> Array:
        """Return the initial state vector, then the audit states such as ∫v' dt, which are zero."""
        return np.concatenate([self.start, np.zeros(self.system.audited_size - self.system.size)])

    def system_at_start(self) -> System:
        """Return the system with the legs of the first sample."""
        return self.schedule.system_at(self.system, float(self.times[0]))

    def breakpoints(self) -> list[float]:
        """Return the breakpoints between the first and the last sample, s."""
        return self.schedule.between(float(self.times[0]), float(self.times[-1]))


@dataclass(frozen=True, eq=False)
class Trajectory:
    """The samples of a run. If it stopped early, its last state is the last sample.

    Args:
        times: Shape (n,), s.
        states: Shape (n, system.size).
        lyapunov_change: ∫v' dt, shape (n,), J.
        contact_work: ε of eq. 26, shape (n,), J.
        status: The status of the run.
        detail: Why and when the run stopped early, as text; else empty.
        steps: Accepted steps.
        evaluations: Evaluations of the rates; for the Taylor engine, of the Taylor expansion.
        switches: The switching of a sliding connector, if there is one.
        systems: The smooth system at each sample; equal ones are one object.
        impacts: The impacts against a stop, if there is one.
        supplied_energy: What the elements have supplied, ∫supplied dt, shape (n,), J; None if no
            element supplies power.
        breakpoints: The breakpoints of the schedule on which the engine ended a step, s.
        trusted_until: The time up to which a motion that slides on s = E, or meets a stop, is
            reproducible in double precision, s. After it, only the slow quantities Θ and e are
            meaningful. NaN if a deadline hides it; None if it is not asked for.
        ends: The ends of its steps; None if the engine keeps none. In quaternions if it integrates
            them.
    """

    times: Array
    states: Array
    lyapunov_change: Array
    contact_work: Array
    status: RunStatus
    detail: str
    steps: int
    evaluations: int
    switches: SwitchTrace | None = None
    systems: tuple[System, ...] = ()
    impacts: ImpactTrace | None = None
    supplied_energy: Array | None = None
    breakpoints: Array = field(default_factory=lambda: np.zeros(0))
    trusted_until: float | None = None
    ends: StepEnds | None = None


class Engine(Protocol):
    """The interface of an engine."""

    def __call__(
        self,
        problem: Problem,
        progress: Progress | None = None,
        deadline: Deadline | None = None,
    ) -> Trajectory:
        """Integrate a problem. A failed integration returns a status and raises no exception.

        Args:
            problem: The problem.
            progress: Called after every step.
            deadline: The deadline of the run. By default it starts with this call, and lasts for
                the time limit of the problem.
        """
        ...


def first_samples(whole: Trajectory, count: int, deadline: Deadline) -> Trajectory:
    """Return the first samples of a trajectory of which no more could be recorded in time.

    Args:
        whole: The trajectory.
        count: The number of samples, at least 1.
        deadline: The deadline, which gives the reason.
    """
    last = float(whole.times[count - 1])
    sampled = "times", "states", "lyapunov_change", "contact_work", "systems", "supplied_energy"
    rows: dict[str, Any] = {name: getattr(whole, name) for name in sampled}
    cut = {name: value[:count] for name, value in rows.items() if value is not None}
    switches, impacts, trusted, ends = (
        getattr(whole, name) for name in ("switches", "impacts", "trusted_until", "ends")
    )
    return replace(
        whole,
        **cut,
        status=RunStatus.TIME_LIMIT,
        detail=f"{deadline.reason} at t = {last:.9g} s",
        switches=switches and switches.until(last, count),
        impacts=impacts and impacts.until(last, count),
        breakpoints=whole.breakpoints[whole.breakpoints <= last],
        trusted_until=None if trusted is None else float(np.minimum(trusted, last)),
        ends=ends and ends.until(last),
    )
