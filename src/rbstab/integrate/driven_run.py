"""A run whose modes the driver of switches follows, of any engine."""

from rbstab.integrate.deadline import Deadline
from rbstab.integrate.problem import Problem, Progress, Trajectory
from rbstab.integrate.run import Run, range_left, zero_length
from rbstab.integrate.status import StopRun
from rbstab.integrate.switching.connector_switches import SoFar
from rbstab.integrate.switching.driver import Driver
from rbstab.integrate.switching.phase import Phase
from rbstab.mechanics.numbers import Array


class DrivenRun(Run):
    """One integration through switches, impacts and breakpoints.

    Args:
        problem: The problem.
        progress: Called after every step.
        deadline: The deadline of the run.
    """

    def __init__(self, problem: Problem, progress: Progress | None, deadline: Deadline) -> None:
        self.driver = Driver(problem)
        super().__init__(problem, progress, deadline, self.phase.system)
        self.owners = problem.system.clearance_owners

    @property
    def phase(self) -> Phase:
        """The current phase."""
        return self.driver.phase

    def result(self) -> Trajectory:
        """Integrate, and return the trajectory with its impacts and switches."""
        trajectory = super().result()
        return self.driver.recorded(trajectory)

    def add_sample(self, t: float, y: Array, so_far: SoFar | None = None) -> None:
        """Keep a sample, and the switches before it.

        Args:
            t: The time, s.
            y: The audited state.
            so_far: The switches before it; default all so far.
        """
        super().add_sample(t, y)
        self.driver.add_sample(y, so_far)

    def add_samples(self, times: list[float], states: Array) -> None:
        """Keep samples, and the switches before them."""
        before = len(self.samples)
        super().add_samples(times, states)
        if self.driver.records:
            for _, y in self.samples[before:]:
                self.driver.add_sample(y)

    def begin(self) -> None:
        """Begin the motion, which may touch its stop."""
        self.go_on(self.driver.begin(self.t, self.y))

    def begin_leg(self, t: float) -> None:
        """Begin the legs of the inputs at a breakpoint, s."""
        self.go_on(self.driver.begin_leg(t, self.y))

    def cross(self, modes: list[int]) -> None:
        """Switch some modes at the current time, and go on."""
        self.go_on(self.driver.cross(modes, self.t, self.y))

    def go_on(self, after: Array) -> None:
        """Go on in the current phase, from a state that may have jumped."""
        self.y, self.system = after, self.phase.system
        self.keep_end()

    def end_of_range(self, number: int) -> StopRun:
        """Return what ends a run: the range if a number is negative, else a spring of no length."""
        return range_left(self.problem) if number < 0 else zero_length(self.owners[number])
