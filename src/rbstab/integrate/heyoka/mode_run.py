"""The motion of a system whose elements switch, with the compiled engine.

The modes are `par[]`: one compilation serves all modes. Each event function of an element is a
terminal event, so a step ends at the first switch in it. Then the driver sets the modes.

heyoka's own loop makes the steps, and goes through switches that change one mode alone
(`inner_switches`). Python code makes a step at a time where the body rests against a stop, and
beside a switch that is hard to find.
"""

from typing import Any

import heyoka as hy
import numpy as np

from rbstab.integrate.deadline import Deadline
from rbstab.integrate.heyoka.compiled_modes import CompiledModes, compiled_modes
from rbstab.integrate.heyoka.inner_switches import InnerSwitches
from rbstab.integrate.heyoka.integrator_state import (
    MIN_STEP,
    STEP_REDUCTION,
    set_motion,
    set_parameters,
    set_state,
    shortened,
)
from rbstab.integrate.heyoka.mode_samples import ModeSamples
from rbstab.integrate.heyoka.symbols import energy_scale, parameter_values
from rbstab.integrate.problem import Problem, Progress, Trajectory, trajectory
from rbstab.integrate.status import RunStatus
from rbstab.integrate.step_ends import StepEnds
from rbstab.integrate.switching.current_phase import CurrentPhase
from rbstab.integrate.switching.first_switch import first_switch
from rbstab.integrate.switching.phases import MISSED, Phase
from rbstab.integrate.watched_rates import StopRun
from rbstab.integrate.zero_length import zero_length
from rbstab.mechanics.numbers import Array
from rbstab.systems.filippov import idle_holds

MUTED = 1e3
"""The offset of an event function that must not be found: with it, the function has no zero."""

NOT_FINITE = hy.taylor_outcome.err_nf_state

RANGE_END = 0
"""The index of the event of the range; those of the modes follow."""


class HeyokaModeRun:
    """One integration in which modes switch.

    Args:
        problem: The problem; its start has a status of its own if the run cannot begin there.
        progress: Called after every step.
        deadline: The deadline of the run.
        switch_limit: The run stops after this many switches; default see `CurrentPhase`.
        scale: The energy scale, J; default that of the start.
    """

    def __init__(
        self,
        problem: Problem,
        progress: Progress | None,
        deadline: Deadline,
        switch_limit: int | None = None,
        scale: float | None = None,
    ) -> None:
        self.problem, self.progress, self.deadline = problem, progress, deadline
        self.current = CurrentPhase(problem, switch_limit)
        self.inner = InnerSwitches(self.current)
        self.offsets = np.zeros(len(self.phase.signs))
        self.scale = energy_scale(problem) if scale is None else scale
        with deadline.paused():
            self.compiled = compiled_modes(self.phase.system, problem.rtol)
        self._use(self.compiled)
        self._idle = idle_holds(self.phase.system)
        self.breakpoints = problem.breakpoints()
        self.reached_breakpoints: list[float] = []
        settings = [problem.range_bound, self.scale, *self.offsets]
        self.values = np.concatenate([parameter_values(self.phase.system), settings])
        self.muted = False
        self.steps = 0
        self.max_step = np.inf
        self._end = float(problem.times[-1])
        # A step and its begin may sum up to another last digit than that of a breakpoint.
        self._spacing = 4.0 * float(np.spacing(self._end))
        self.samples = ModeSamples(problem, self.current, deadline)
        self._owners = problem.system.clearance_owners
        set_motion(self.integrator, problem.times[0], problem.audited_start())
        self._set_parameters()
        self.samples.add(float(problem.times[0]), problem.audited_start())
        self.ends = StepEnds()
        self.ends.add(float(problem.times[0]), problem.audited_start(), self.phase.system)

    @property
    def phase(self) -> Phase:
        """The current phase."""
        return self.current.phase

    def _use(self, compiled: CompiledModes) -> None:
        """Use the integrator of some compiled equations."""
        self.compiled, self.integrator = compiled, compiled.integrator
        # A view of the integrator's memory: getting it takes longer than reading it.
        self._state = compiled.integrator.state
        self.inner.use(compiled)

    def _use_that_of_phase(self) -> None:
        """Go on with the integrator of the current phase, at the same time and state."""
        with self.deadline.paused():
            compiled = compiled_modes(self.phase.system, self.problem.rtol)
        if compiled is not self.compiled:
            set_motion(compiled.integrator, self.integrator.time, self._state)
            self.inner.release()
            self._use(compiled)

    def result(self) -> Trajectory:
        """Integrate, and return the trajectory with the smooth system at each sample."""
        try:
            return self._result()
        finally:
            # The integrator is cached: a reference to this run would keep it in memory.
            self.inner.release()

    def _result(self) -> Trajectory:
        status, reason = RunStatus.COMPLETED, ""
        try:
            self._integrate()
        except StopRun as stop:
            integrator = self.integrator
            state = integrator.state.copy()
            time, samples = integrator.time, self.samples
            is_next = time > samples.last_time and not samples.lacks(time)
            if is_next and np.isfinite(state).all():
                samples.add(time, state)
                self.ends.add(time, state, self.phase.system)
            status, reason = stop.status, f"{stop} at t = {samples.last_time:.9g} s"
        found = trajectory(
            self.problem,
            self.samples.in_joules(self.scale),
            status,
            reason,
            self.steps,
            self.steps,
            tuple(self.samples.systems),
            self.reached_breakpoints,
            self.ends,
        )
        return self.current.recorded(found)

    def _integrate(self) -> None:
        if self.current.impacts is not None:
            state = self.current.impacts.begin(self.integrator.time, self._state.copy())
            self._go_on_from(state)
        while not self.samples.are_complete:
            if self.steps >= self.problem.step_limit:
                raise StopRun(RunStatus.STEP_LIMIT, f"stopped after {self.steps} steps")
            event = self._advance(self.breakpoints[0] if self.breakpoints else self._end)
            if self.samples.lacks(self.integrator.time):
                raise StopRun(RunStatus.TIME_LIMIT, self.deadline.reason)
            self._check_end(event)
            if self.samples.are_complete:
                # A limit reached in the last step does not count.
                return
            if self.deadline.expired():
                raise StopRun(RunStatus.TIME_LIMIT, self.deadline.reason)
            if self.phase.rests:
                self._state[:] = self.phase.on_stop(self._state.copy())
            if event is not None or self.least_margin < 0:
                self._switch()
            if self.breakpoints and self.breakpoints[0] - self.integrator.time < self._spacing:
                self._begin_leg(self.breakpoints.pop(0))
            if self.muted:
                self._unmute()

    def _advance(self, last: float) -> int | None:
        """Make one step or many, to a time, s, at most, and store their samples.

        Returns:
            The index of the event at the end; None without one.
        """
        if self._takes_many_steps(last):
            return self._steps_to(last)
        event = self._step(last)
        self._add_samples_of_step()
        if self.progress is not None:
            self.progress(self.integrator.time)
        return event

    def _takes_many_steps(self, last: float) -> bool:
        """Return whether heyoka's loop makes the next steps, to an event or to a time at most."""
        return not (self.muted or self.phase.rests or self.max_step < last - self.integrator.time)

    def _steps_to(self, last: float) -> int | None:
        """Make steps in heyoka's loop, to an event or to a time, s, and store their samples.

        If a step has missed a switch, the motion goes back to its begin; `_step` makes it again.

        Returns:
            The index of the event; None without one.
        """
        integrator, begin = self.integrator, self.integrator.time
        # heyoka knows its time to more digits than a motion that goes back.
        integrator.time = begin
        self._checkpoint = begin, self._state.copy()
        with self.inner.loop(begin):
            outcome, _, _, steps, _, _ = integrator.propagate_until(
                last,
                max_steps=self.problem.step_limit - self.steps,
                callback=self._after_step,
                write_tc=True,
            )
        self.steps += max(steps, 1)
        self.least_margin, missed = self.inner.least_margin, self.inner.missed
        if missed or outcome == NOT_FINITE:
            self.max_step, self.least_margin = shortened(integrator.last_h), np.inf
            set_motion(integrator, *self._checkpoint)
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

    def _check_end(self, event: int | None) -> None:
        """Stop the run if an event is none of a switch."""
        if event == RANGE_END:
            bound = self.problem.range_bound
            raise StopRun(RunStatus.RANGE_LEFT, f"cos θ2 fell to {bound:g}")
        number = -1 if event is None else event - 1 - len(self.compiled.event_modes)
        if number >= 0:
            raise zero_length(self._owners[number])

    def _begin_leg(self, t: float) -> None:
        """Begin the legs of the inputs at a breakpoint."""
        assert self.problem.schedule is not None
        self.integrator.time = t
        self.reached_breakpoints.append(t)
        state = self.integrator.state.copy()
        after = self.current.begin_leg(t, state)
        places = self.problem.schedule.places(self.compiled.names)
        self.values[places] = self.problem.schedule.legs_at(t)
        self._go_on(state, after)
        self.samples.begin_leg(t)

    def _step(self, last: float) -> int | None:
        """Make a step to an event, or of the engine's choice; repeat it if it missed a switch.

        Returns:
            The index of the event; None if the step ended without one.
        """
        begin, state = self.integrator.time, self._state.copy()
        while True:
            # A switch at the begin of the step may have changed both.
            integrator, phase = self.integrator, self.phase
            length = min(self.max_step, last - begin)
            outcome, made = integrator.step(max_delta_t=length, write_tc=True)
            self.steps += 1
            if outcome == NOT_FINITE:
                set_motion(integrator, begin, state)
                raise StopRun(RunStatus.DIVERGED, "the state stopped being finite")
            margins = phase.margin_list(self._state, integrator.time)
            self.least_margin = min(margins)
            shorter = shortened(made) if self.inner.is_missed(margins) else None
            if self.muted:
                shorter = self._muted_switch(begin, state, shorter)
            if shorter is None:
                break
            set_motion(self.integrator, begin, state)
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

    def _event_of(self, outcome: Any, made: float) -> int | None:
        """Return the index of the event at which steps have ended; None if there is none.

        Args:
            outcome: heyoka's outcome.
            made: The length of the last step, s.
        """
        index, modes = -1 - outcome.value, self.compiled.event_modes
        found = 0 <= index <= len(modes) + len(self._owners)
        if 0 < index <= len(modes) and made == 0.0:
            # The step began on a zero of the event function, as after a switch. If it is a double
            # zero, heyoka would find it for ever.
            self.offsets[modes[index - 1]], self.muted = MUTED, True
        return index if found else None

    def _muted_switch(self, begin: float, state: Array, shorter: float | None) -> float | None:
        """Search a step for switches by muted event functions.

        A mode that is wrong from the start of the step is switched there.

        Args:
            begin: The start of the step, s.
            state: The state there. An impact changes it.
            shorter: The length with which it must be repeated anyway, or None.

        Returns:
            The length with which the step must be repeated, s; None if it need not be repeated.
        """
        integrator, phase = self.integrator, self.phase
        end = integrator.time
        if end == begin:
            return shorter

        def path(t: Any) -> Array:
            columns = [integrator.update_d_output(one).copy() for one in np.atleast_1d(t)]
            return np.array(columns).T if np.ndim(t) else columns[0]

        states = np.array([state, integrator.state])
        rates = np.array(
            [phase.audited_rates(y, t) for y, t in zip(states, (begin, end), strict=True)]
        )
        found = first_switch(phase, path, (begin, end), states, rates)
        if found is None or not self.offsets[found.mode] or found.time >= end:
            return shorter
        if found.time <= begin:
            # The switch may end the run: then it ends where the step began.
            set_motion(integrator, begin, state)
            self._flip([found.mode], begin)
            state[:] = self._state
            return end - begin
        return found.time - begin

    def _switch(self) -> None:
        """Switch all modes whose margins have reached zero at the current state."""
        state, t = self.integrator.state, self.integrator.time
        switched = self.phase.coinciding(state, t).tolist()
        # Without one, heyoka has found the last switch again, or a margin only touches zero.
        if switched:
            self._flip(switched, t)

    def _flip(self, modes: list[int], t: float) -> None:
        """Switch modes at a time that has been reached; the state may jump."""
        state = self.integrator.state.copy()
        self._go_on(state, self.current.cross(modes, t, state))

    def _go_on(self, before: Array, after: Array) -> None:
        """Go on in the current phase from the state after a switch, which may have jumped."""
        self.ends.add(self.integrator.time, after, self.phase.system)
        if after is not before and self.current.impacts is not None:
            self._go_on_from(after)
            return
        if after is not before:
            set_state(self.integrator, after)
        self._set_parameters()

    def _go_on_from(self, state: Array) -> None:
        """Go on from a state that an impact has changed.

        It lies on the event function of the stop, and the next hop may be shorter than heyoka's
        cooldown. So this event is muted until it has left zero; `first_switch` finds the next hop.
        """
        integrator = self.integrator
        set_state(integrator, state)
        margins = self.phase.margins(state, integrator.time)
        self.offsets[np.abs(margins) <= MISSED] = MUTED
        self._set_parameters()

    def _unmute(self) -> None:
        """Let event functions be found again that have left zero."""
        margins = self.phase.margins(self._state, self.integrator.time)
        self.offsets[np.abs(margins) > MISSED] = 0.0
        self._set_parameters()

    def _set_parameters(self) -> None:
        if idle_holds(self.phase.system) != self._idle:
            self._use_that_of_phase()
            self._idle = idle_holds(self.phase.system)
        self.inner.floors = self.phase.floors(self._state, self.integrator.time)
        self.values[self.compiled.modes] = 0.5 * (1.0 + self.phase.signs)
        self.values[-len(self.offsets) :] = self.offsets
        self.muted = bool(self.offsets.any())
        set_parameters(self.integrator, self.values)

    def _add_samples_of_step(self) -> None:
        """Add the samples within the last step."""
        before, self.inner.before = self.inner.before, None
        system = self.phase.system if before is None else before.system
        self.ends.add(self.integrator.time, self._state.copy(), system)
        self.samples.add_passed(self.integrator, before)
