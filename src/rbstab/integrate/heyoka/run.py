"""The motion of a system with the compiled engine, also through switches.

The modes are `par[]`: one compilation serves all modes. Each event function of an element is a
terminal event, so a step ends at the first switch in it. Then the driver sets the modes.

heyoka's own loop makes the steps, and goes through switches that change one mode alone
(`inner_switches`). Python code makes a step at a time where the body rests against a stop, and
beside a switch that is hard to find: heyoka's root isolation can miss a zero beside the start of a
step. Such a step is undone, and made again with a part of its length until the event is found.
"""

from bisect import bisect_left, bisect_right
from dataclasses import replace
from typing import Any

import heyoka as hy
import numpy as np

from rbstab.integrate.deadline import Deadline
from rbstab.integrate.driven_run import DrivenRun
from rbstab.integrate.events import first_event
from rbstab.integrate.heyoka.equations import CompiledEquations, compiled_equations
from rbstab.integrate.heyoka.inner_switches import InnerSwitches
from rbstab.integrate.heyoka.symbols import (
    energy_scale,
    parameter_values,
    set_motion,
    set_parameters,
    set_state,
)
from rbstab.integrate.problem import Problem, Progress, Trajectory
from rbstab.integrate.status import RunStatus, StopRun
from rbstab.integrate.switching.phase import MISSED
from rbstab.mechanics.constraint import projected_state
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import BODY
from rbstab.systems.filippov import idle_holds

MUTED = 1e3
"""The offset of an event function that must not be found: with it, the function has no zero."""

STEP_REDUCTION = 16
"""A step that missed an event is repeated with its length divided by this."""

MIN_STEP = 1e-18
"""s: the run fails if a step shorter than this would be needed to find a missed event."""

IN_BLOCK = 100
"""This many samples are made between two looks at the deadline: one step may have thousands."""

NOT_FINITE = hy.taylor_outcome.err_nf_state


class HeyokaRun(DrivenRun):
    """One integration.

    Args:
        problem: The problem; `rtol` is its only tolerance.
        progress: Called after every step.
        deadline: The deadline of the run.
        scale: The energy scale, J; default that of the start.
    """

    def __init__(
        self,
        problem: Problem,
        progress: Progress | None,
        deadline: Deadline,
        scale: float | None = None,
    ) -> None:
        super().__init__(problem, progress, deadline)
        self.inner = InnerSwitches(self.driver)
        self.audit_scale = energy_scale(problem) if scale is None else scale
        self.offsets = np.zeros(len(self.phase.signs))
        self.muted, self.max_step, self.least_margin = False, np.inf, np.inf
        # A step and its begin may sum up to another last digit than that of a breakpoint.
        self.spacing = 4.0 * float(np.spacing(self.times[-1]))

    def result(self) -> Trajectory:
        """Integrate, and return the trajectory with its impacts and switches."""
        try:
            return replace(super().result(), evaluations=self.steps)
        finally:
            # The integrator is cached: a reference to this run would keep it in memory.
            self.inner.release()

    def begin(self) -> None:
        """Compile the equations, and begin the motion, which may touch its stop."""
        settings = [self.problem.range_bound, self.audit_scale, *self.offsets]
        self.values = np.concatenate([parameter_values(self.phase.system), settings])
        self._use_equations_of_phase()
        self._set_parameters()
        super().begin()

    def begin_leg(self, t: float) -> None:
        """Begin the legs of the inputs at a breakpoint, s."""
        schedule = self.problem.schedule
        self.t = self.integrator.time = t
        self.values[schedule.places(self.compiled.names)] = schedule.legs_at(t)
        super().begin_leg(t)

    def follow_to(self, stop: float) -> None:
        """Make one step or many, to a time, s, at most, or to an event."""
        self.check_limits()
        self._stop = stop
        if not len(self.offsets):
            event = self._smooth_steps_to(stop)
        elif self.muted or self.phase.rests or self.max_step < stop - self.integrator.time:
            event = self._single_step_to(stop)
        else:
            event = self._steps_to(stop)
        if self.lacks_before(min(self.integrator.time, stop)):
            raise StopRun(RunStatus.TIME_LIMIT, self.deadline.reason)
        self._check_end(event)
        if self.phase.rests:
            self._state[:] = self.phase.on_stop(self._state.copy())
        self.t, self.y = self.integrator.time, self._state.copy()
        if event is not None or self.least_margin < 0:
            # Without one, heyoka has found the last switch again, or a margin only touches zero.
            switched = self.phase.coinciding(self.y, self.t).tolist()
            if switched:
                self.cross(switched)
        self.system = self.phase.system
        if self.muted:
            # Event functions that have left zero may be found again.
            margins = self.phase.margins(self._state, self.integrator.time)
            self.offsets[np.abs(margins) > MISSED] = 0.0
            self._set_parameters()

    def _use_equations_of_phase(self) -> None:
        """Use the integrator of the current phase, at the time and the state of the run."""
        with self.deadline.paused():
            compiled = compiled_equations(self.phase.system, self.problem.rtol)
        self.inner.release()
        self.compiled: CompiledEquations = compiled
        self.integrator = compiled.integrator
        # A view of the integrator's memory: getting it takes longer than reading it.
        self._state = compiled.integrator.state
        self.inner.use(compiled)
        self._idle = idle_holds(self.phase.system)
        set_motion(self.integrator, self.t, self.y)

    # Steps.

    def _smooth_steps_to(self, stop: float) -> int | None:
        """Make steps to a time, s, of equations without modes."""
        integrator, begin = self.integrator, len(self.samples)
        wanted = self.times[begin : bisect_left(self.times, stop, begin)]
        outcome, _, _, steps, _, states = integrator.propagate_grid(
            [integrator.time, *wanted, stop],
            max_steps=self.problem.step_limit - self.steps,
            callback=self._after_smooth_step,
        )
        self.steps += steps
        self.add_samples(wanted, states[1:])
        if outcome == NOT_FINITE:
            raise StopRun(RunStatus.DIVERGED, "the state stopped being finite")
        return self._event_of(outcome, integrator.last_h)

    def _after_smooth_step(self, integrator: Any) -> bool:
        """Return whether heyoka's loop goes on; heyoka calls this after each step."""
        if self.problem.project:
            body, anchor = self.system.body, self.system.anchor
            self._state[BODY] = projected_state(body, anchor, self._state[BODY])
        self.t, self.y = t, y = integrator.time, self._state.copy()
        self.ends.add(t, y, self.system)
        if self.progress is not None:
            self.progress(t)
        if self.deadline.recording_time:
            self.deadline.samples = bisect_right(self.times, self.t)
        return not self.deadline.expired()

    def _steps_to(self, stop: float) -> int | None:
        """Make steps in heyoka's loop to an event, whose index is returned, or to a time, s."""
        integrator, begin = self.integrator, self.integrator.time
        # heyoka knows its time to more digits than a motion that goes back.
        integrator.time = begin
        self._checkpoint = begin, self._state.copy()
        with self.inner.loop(begin):
            outcome, _, _, steps, _, _ = integrator.propagate_until(
                stop,
                max_steps=self.problem.step_limit - self.steps,
                callback=self._after_step,
                write_tc=True,
            )
        self.steps += max(steps, 1)
        self.least_margin, missed = self.inner.least_margin, self.inner.missed
        # If a step has missed a switch, `_step` makes it again.
        if missed or outcome == NOT_FINITE:
            self.max_step, self.least_margin = abs(integrator.last_h) / STEP_REDUCTION, np.inf
            self._go_back(*self._checkpoint)
        else:
            self._add_samples_of_step()
        if outcome == NOT_FINITE:
            raise StopRun(RunStatus.DIVERGED, "the state stopped being finite")
        return None if missed else self._event_of(outcome, integrator.last_h)

    def _after_step(self, integrator: Any) -> bool:
        """Return whether heyoka's loop goes on; heyoka calls this after each step."""
        t = integrator.time
        if self.inner.has_missed(t):
            return False
        self._checkpoint = t, self._state.copy()
        self._add_samples_of_step()
        if self.progress is not None:
            self.progress(t)
        # A step of no length ends at an event, which heyoka does not tell if the loop ends here.
        is_clear = self.inner.least_margin >= 0 and not self.deadline.expired()
        return is_clear or integrator.last_h == 0

    def _go_back(self, t: float, state: Array) -> None:
        """Go back to a time, s, and the state there."""
        set_motion(self.integrator, t, state)
        self.t, self.y = t, state

    def _single_step_to(self, stop: float) -> int | None:
        """Make one step, at most to a time, s, and store its samples; see `_steps_to`."""
        event = self._step(stop)
        self._add_samples_of_step()
        if self.progress is not None:
            self.progress(self.integrator.time)
        return event

    def _step(self, stop: float) -> int | None:
        """Make a step, again if it missed a switch; return the index of its event, or None."""
        begin, state = self.integrator.time, self._state.copy()
        while True:
            # A switch at the begin of the step may have changed both.
            integrator, phase = self.integrator, self.phase
            length = min(self.max_step, stop - begin)
            outcome, made = integrator.step(max_delta_t=length, write_tc=True)
            self.steps += 1
            if outcome == NOT_FINITE:
                self._go_back(begin, state)
                raise StopRun(RunStatus.DIVERGED, "the state stopped being finite")
            margins = phase.margin_list(self._state, integrator.time)
            self.least_margin = min(margins)
            shorter = abs(made) / STEP_REDUCTION if self.inner.is_missed(margins) else None
            if self.muted:
                shorter = self._muted_switch(begin, state, shorter)
            if shorter is None:
                break
            self._go_back(begin, state)
            self.max_step = shorter
            if shorter < MIN_STEP:
                if not phase.coinciding(state, begin).size:
                    raise StopRun(RunStatus.SOLVER_FAILURE, "a switch could not be found")
                # The switch is at the begin of the step, up to round-off.
                return None
        # After a missed switch the steps grow again, one by one: it may be the first of several
        # hops at a stop.
        self.max_step *= STEP_REDUCTION
        return self._event_of(outcome, made)

    def _muted_switch(self, begin: float, state: Array, shorter: float | None) -> float | None:
        """Search a step for muted switches; return with which length, s, to repeat it, or None."""
        integrator, phase = self.integrator, self.phase
        end = integrator.time
        # `shorter` is the length with which it must be repeated anyway, or None.
        if end == begin:
            return shorter

        def path(t: Any) -> Array:
            columns = [integrator.update_d_output(time).copy() for time in np.atleast_1d(t)]
            return np.array(columns).T if np.ndim(t) else columns[0]

        ends, states = (begin, end), (state, integrator.state.copy())
        slopes = tuple(phase.margin_rates(y, t) for y, t in zip(states, ends, strict=True))
        event = first_event(phase.margins, path, ends, states, slopes)
        if event is None or not self.offsets[event.number] or event.time >= end:
            return shorter
        if event.time <= begin:
            # The mode is wrong from the begin of the step, and is switched there.
            # The switch may end the run: then it ends where the step began.
            self._go_back(begin, state)
            self.go_on(self.driver.cross([event.number], begin, state.copy()))
            # An impact changes the state.
            state[:] = self._state
            return end - begin
        return event.time - begin

    def _event_of(self, outcome: Any, made: float) -> int | None:
        """Return the index of the event at which steps have ended; None if there is none."""
        # The first event is the end of the range. Those of the modes follow, then those of lengths.
        index, modes = -1 - outcome.value, self.compiled.event_modes
        is_event = 0 <= index <= len(modes) + len(self.owners)
        if 0 < index <= len(modes) and made == 0.0:
            # The step began on a zero of the event function, as after a switch. If it is a double
            # zero, heyoka would find it for ever.
            self.offsets[modes[index - 1]], self.muted = MUTED, True
        return index if is_event else None

    def _check_end(self, event: int | None) -> None:
        """Stop the run if an event is none of a switch."""
        number = -1 if event is None else event - 1 - len(self.compiled.event_modes)
        if event == 0 or number >= 0:
            self.t, self.y = self.integrator.time, self._state.copy()
            raise self.end_of_range(number)

    def go_on(self, after: Array) -> None:
        """Go on in the current phase from the state after a switch, which may have jumped.

        After an impact it lies on the event function of the stop, and the next hop may be shorter
        than heyoka's cooldown. So this event is muted until it has left zero; `first_event` finds
        the next hop.
        """
        jumps = after is not self.y
        super().go_on(after)
        if jumps:
            set_state(self.integrator, after)
            if self.driver.impacts is not None:
                margins = self.phase.margins(after, self.integrator.time)
                self.offsets[np.abs(margins) <= MISSED] = MUTED
        self._set_parameters()

    def _set_parameters(self) -> None:
        if idle_holds(self.phase.system) != self._idle:
            self._use_equations_of_phase()
        if len(self.offsets):
            self.inner.floors = self.phase.floors(self._state, self.integrator.time)
            self.values[self.compiled.modes] = 0.5 * (1.0 + self.phase.signs)
            self.values[-len(self.offsets) :] = self.offsets
        self.muted = bool(self.offsets.any())
        set_parameters(self.integrator, self.values)

    def _add_samples_of_step(self) -> None:
        """Add the samples within the last step, all of one phase: that before its last switch."""
        before, self.inner.before = self.inner.before, None
        so_far, integrator = before or self.driver.so_far(), self.integrator
        self.system = so_far.system
        self.t, self.y = integrator.time, self._state.copy()
        self.keep_end()
        # A sample at the end of the run, or where legs begin, is not one of them.
        end = min(self.t, np.nextafter(self._stop, -np.inf))
        while self.lacks(end):
            begin = len(self.samples)
            block = self.times[begin : begin + IN_BLOCK]
            for t in block[: bisect_right(block, end)]:
                state = self.phase.on_stop(integrator.update_d_output(t).copy())
                self.add_sample(t, state, so_far)
            if self.lacks(end) and self.deadline.expired():
                return
