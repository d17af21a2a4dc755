"""The motion of a system whose elements switch, by SciPy's one-step methods.

A step in which a mode switches is repeated so that it ends at the switch, because dense output is
less accurate than steps. The time of the switch is then corrected by the margin at the end of the
repeated step. So the order of the method holds through all switches.
"""

from typing import Any

import numpy as np

from rbstab.integrate.deadline import Deadline
from rbstab.integrate.problem import Problem, Progress, Trajectory
from rbstab.integrate.scipy_run import ScipyRun
from rbstab.integrate.switching.current_phase import CurrentPhase
from rbstab.integrate.switching.first_switch import first_switch
from rbstab.integrate.switching.phases import Phase, Switch
from rbstab.mechanics.numbers import Array

MAX_CORRECTIONS = 4
"""The most repetitions of a step that ends at a switch. Two are enough, unless the margin falls so
slowly that its round-off hides the time."""

DECREASE = 0.5
"""A correction of the time that is not smaller than the last one times this is round-off."""


class ModeRun(ScipyRun):
    """One integration in which modes switch.

    Args:
        problem: The problem; its method is a one-step method.
        progress: Called after every step.
        deadline: The deadline of the run.
        switch_limit: The run stops after this many switches; default see `CurrentPhase`.
    """

    def __init__(
        self,
        problem: Problem,
        progress: Progress | None,
        deadline: Deadline,
        switch_limit: int | None = None,
    ) -> None:
        self.current = CurrentPhase(problem, switch_limit)
        super().__init__(problem, progress, deadline)
        self._follow_modes()

    @property
    def phase(self) -> Phase:
        """The current phase."""
        return self.current.phase

    def result(self) -> Trajectory:
        """Integrate, and return the trajectory with its impacts and switches."""
        return self.current.recorded(super().result())

    def _add_sample(self, t: float, y: Array) -> None:
        super()._add_sample(t, y)
        self.systems.append(self.phase.system)
        self.current.add_sample(y)

    def _integrate(self) -> None:
        if self.current.impacts is not None:
            self.y = self.current.impacts.begin(self.t, self.y)
            self._follow_modes()
        super()._integrate()

    def _follow_to(self, end: float) -> None:
        while self.t < end:
            self._follow_phase(end)

    def _begin_leg(self, t: float) -> None:
        self.y = self.current.begin_leg(t, self.y)
        self._follow_modes()

    def _follow_phase(self, end: float) -> None:
        """Step until a time, or through the first switch."""
        solver = self._call_solver(self._new_solver, end)
        while solver.status == "running":
            first_rates = solver.f
            self._step(solver)
            states, rates = np.array([self.y, solver.y]), np.array([first_rates, solver.f])
            path = solver.dense_output()
            switch = first_switch(self.phase, path, (self.t, solver.t), states, rates)
            if switch is not None:
                self._step_to(switch)
                self._switch(switch.mode)
                return
            self._check_range(solver)
            self._accept(solver)

    def _step_to(self, switch: Switch) -> None:
        """Make steps that end at a switch, instead of the step in which it was found."""
        target, last = switch.time, np.inf
        for _ in range(MAX_CORRECTIONS):
            if target <= self.t:
                return
            solver = self._solver_at(target)
            margin = float(self.phase.margins(solver.y, solver.t)[switch.mode])
            rate = float(self.phase.margin_rates(solver.y, solver.t)[switch.mode])
            correction = -margin / rate if rate < 0 else 0.0
            small = abs(correction) <= float(np.spacing(target))
            inside = self.t < target + correction <= max(switch.latest, target)
            if small or not inside or abs(correction) > DECREASE * last:
                break
            target, last = target + correction, abs(correction)
        self._check_range(solver)
        self._accept(solver)

    def _accept(self, solver: Any) -> None:
        super()._accept(solver)
        if solver.status == "finished":
            # The next step is made by a new solver, so the state may be moved.
            self.y = self.phase.on_stop(self.y)

    def _solver_at(self, target: float) -> Any:
        """Return a solver that has arrived at a time; its last step is not accepted yet."""
        solver = self._call_solver(self._new_solver, target)
        self._step(solver)
        while solver.status == "running":
            # The first part of a step that was divided is before the switch.
            self._check_range(solver)
            self._accept(solver)
            self._step(solver)
        return solver

    def _switch(self, mode: int) -> None:
        """Switch a mode at the current state, with all that switch at the same time."""
        coinciding = self.phase.coinciding(self.y, self.t).tolist()
        self.y = self.current.cross(sorted({mode, *coinciding}), self.t, self.y)
        self._follow_modes()

    def _follow_modes(self) -> None:
        """Go on in the current phase, from a state that may have jumped."""
        self.system, self.rates.audited_rates = self.phase.system, self.phase.audited_rates
        self.ends.add(self.t, self.y, self.system)
