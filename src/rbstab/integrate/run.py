"""What a run of any engine keeps of its motion, from breakpoint to breakpoint, and why it ends."""

import numpy as np

from rbstab.integrate.deadline import Deadline
from rbstab.integrate.problem import Problem, Progress, Trajectory
from rbstab.integrate.status import RunStatus, StopRun
from rbstab.integrate.step_ends import StepEnds
from rbstab.mechanics.attitude import regularity
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import THETA
from rbstab.systems.system import CONTACT_WORK, LYAPUNOV_CHANGE, System


class Run:
    """One integration of a problem. An engine defines `follow_to`.

    Args:
        problem: The problem.
        progress: Called after every step.
        deadline: The deadline of the run.
        system: The smooth system at the start.

    Attributes:
        system: The smooth system that the motion follows now.
        t: The time that is reached, s.
        y: The audited state there. A new one is another array.
        samples: The time, s, and the audited state of each sample.
        systems: The smooth system at each sample.
        steps: Accepted steps.
        evaluations: Evaluations of the rates.
        ends: The ends of the steps.
        audit_scale: The unit of the audit states of the engine, J.
    """

    audit_scale = 1.0
    spacing = 0.0
    """s: a time that is closer than this to its target has reached it."""

    def __init__(
        self, problem: Problem, progress: Progress | None, deadline: Deadline, system: System
    ) -> None:
        self.problem, self.progress, self.deadline = problem, progress, deadline
        self.system = system
        self.t, self.y = float(problem.times[0]), problem.audited_start()
        self.samples: list[tuple[float, Array]] = []
        self.systems: list[System] = []
        self.steps = self.evaluations = 0
        self.reached_breakpoints: list[float] = []
        self.ends = StepEnds()
        self.times = problem.times.tolist()
        self._size = problem.system.size

    def result(self) -> Trajectory:
        """Integrate, and return the trajectory. A failure is its status."""
        status, detail = RunStatus.COMPLETED, ""
        self.keep_end()
        self.add_sample(self.t, self.y)
        try:
            check_start(self.problem)
            self.begin()
            self._integrate()
        except StopRun as stop:
            self.keep_last()
            status, detail = stop.status, f"{stop} at t = {self.samples[-1][0]:.9g} s"
        return self._trajectory(status, detail)

    def begin(self) -> None:
        """Begin the motion, at whose start the state may jump."""

    def stops(self) -> list[float]:
        """Return the times on which a step must end, s, ascending: the last sample is the last."""
        return [*self.problem.breakpoints(), self.times[-1]]

    def follow_to(self, stop: float) -> None:
        """Follow the motion to a time, s, and keep its samples before it."""
        raise NotImplementedError

    def begin_leg(self, t: float) -> None:
        """Begin the legs of the inputs at a breakpoint, s."""
        raise NotImplementedError

    def _integrate(self) -> None:
        breakpoints = frozenset(self.problem.breakpoints())
        for stop in self.stops():
            while stop - self.t > self.spacing:
                self.follow_to(stop)
            if stop in breakpoints:
                self.reached_breakpoints.append(stop)
                self.begin_leg(stop)
            if self.lacks(stop):
                self.add_sample(stop, self.y)

    def lacks(self, time: float) -> bool:
        """Return whether a sample up to a time, s, is not there yet."""
        count = len(self.samples)
        return count < len(self.times) and self.times[count] <= time

    def lacks_before(self, time: float) -> bool:
        """Return whether a sample before a time, s, is not there yet."""
        return self.lacks(float(np.nextafter(time, -np.inf)))

    def add_sample(self, t: float, y: Array) -> None:
        """Keep a sample: its time, s, and its audited state."""
        self.samples.append((t, y))
        self.systems.append(self.system)
        self.deadline.samples = len(self.samples)

    def add_samples(self, times: list[float], states: Array) -> None:
        """Keep samples of one smooth piece of the motion, as `add_sample` does."""
        self.samples += zip(times, states, strict=False)
        self.systems += [self.system] * (len(self.samples) - len(self.systems))
        self.deadline.samples = len(self.samples)

    def keep_end(self) -> None:
        """Keep the end of a step, or the state to which the last one has jumped."""
        self.ends.add(self.t, self.y, self.system)

    def keep_last(self) -> None:
        """Keep the state in which the run ends, as its last sample."""
        if self.t > self.samples[-1][0] and not self.lacks_before(self.t):
            self.add_sample(self.t, self.y)
        self.keep_end()

    def _trajectory(self, status: RunStatus, detail: str) -> Trajectory:
        size = self._size
        table = np.array([state for _, state in self.samples])
        table[:, size:] *= self.audit_scale
        times = np.array([time for time, _ in self.samples])
        return Trajectory(
            times,
            table[:, :size],
            table[:, LYAPUNOV_CHANGE],
            table[:, CONTACT_WORK],
            status,
            detail,
            self.steps,
            self.evaluations,
            systems=tuple(self.systems),
            supplied_energy=table[:, size] if self.problem.system.supplies else None,
            breakpoints=np.array(self.reached_breakpoints),
            ends=self.ends,
        )

    def check_limits(self) -> None:
        """Stop a run that has reached its deadline or its limit of steps."""
        self.check_deadline()
        if self.steps >= self.problem.step_limit:
            raise StopRun(RunStatus.STEP_LIMIT, f"stopped after {self.steps} steps")

    def check_deadline(self) -> None:
        """Stop a run that has reached its deadline."""
        if self.deadline.expired():
            raise StopRun(RunStatus.TIME_LIMIT, self.deadline.reason)


def check_start(problem: Problem) -> None:
    """Check the start of a problem.

    Raises:
        StopRun: The run cannot begin there.
    """
    y, t = problem.audited_start(), float(problem.times[0])
    with np.errstate(all="ignore"):
        clearances = problem.system.clearances(y)
        rates = problem.system_at_start().audited_rates(y, t)
    # A state that is not a number has other reasons.
    if (clearances <= 0).any():
        raise zero_length(problem.system.clearance_owners[int((clearances <= 0).argmax())])
    if not (np.isfinite(y).all() and np.isfinite(rates).all()):
        raise StopRun(RunStatus.DIVERGED, "the rates are not finite")
    if regularity(y[THETA]) <= problem.range_bound:
        raise range_left(problem)


def range_left(problem: Problem) -> StopRun:
    """Return what ends a run at the end of the range of eq. 5."""
    return StopRun(RunStatus.RANGE_LEFT, f"cos θ2 fell to {problem.range_bound:g}")


def zero_length(name: str) -> StopRun:
    """Return what ends a run where a spring has no length."""
    reason = f"{name} has no length, so its direction is undefined"
    return StopRun(RunStatus.ZERO_LENGTH, reason)
