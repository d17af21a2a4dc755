"""The motion of a system whose elements switch, with the compiled engine.

The modes are `par[]`: one compilation serves all modes. Each event function of an element is a
terminal event, so a step ends at the first switch in it. Then the driver sets the modes.
"""

from bisect import bisect_right
from typing import Any

import heyoka as hy
import numpy as np

from rbstab.integrate.deadline import Deadline
from rbstab.integrate.heyoka.compile_cache import compiled_once
from rbstab.integrate.heyoka.integrator_state import (
    MIN_STEP,
    STEP_REDUCTION,
    set_motion,
    set_parameters,
    set_state,
    shortened,
)
from rbstab.integrate.heyoka.symbols import (
    compiled_zeros,
    energy_scale,
    parameter_values,
    scaled_audit,
    state_symbols,
    symbols_of,
    symbols_with_zeros,
)
from rbstab.integrate.modes.current_phase import CurrentPhase
from rbstab.integrate.modes.first_switch import first_switch
from rbstab.integrate.modes.phases import Phase
from rbstab.integrate.problem import Problem, Progress, Trajectory, trajectory
from rbstab.integrate.status import RunStatus
from rbstab.integrate.watched_rates import StopRun
from rbstab.integrate.zero_length import zero_length
from rbstab.mechanics.attitude import regularity
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import THETA
from rbstab.systems.impact import stop_of
from rbstab.systems.modes import guards_at
from rbstab.systems.parameters import parameters, structure
from rbstab.systems.system import System

MISSED = 1e-13
"""If a margin is below minus this after a step, the step missed a switch. Margins of elements have
several units, and stay at zero after a switch, up to round-off; so it is not that of `flow`."""

MAX_UNROLLED = 4
"""Modes of a system whose equations are compiled without loops. Loops take a tenth of the time to
compile, and five times as long to run."""

MUTED = 1e3
"""The offset of an event function that must not be found: with it, the function has no zero."""

NOT_FINITE = hy.taylor_outcome.err_nf_state

RANGE_END = 0
"""The index of the event of the range; those of the modes follow."""


class CompiledModes:
    """The compiled audited equations of one structure, in all modes.

    Its `par[]` are the parameters of the system, the range bound, the energy scale, and an offset
    of each event function.

    Args:
        system: Any system of the structure with the same zeros (`compiled_zeros`).
        tolerance: heyoka's tolerance.

    Attributes:
        integrator: heyoka's integrator.
        modes: The index of the `par[]` of each mode.
        names: The index of the first `par[]` of each parameter.
    """

    def __init__(self, system: System, tolerance: float) -> None:
        symbol_of = symbols_with_zeros(compiled_zeros(system))
        symbolic, first, count = symbols_of(system, symbol_of)
        places = [
            first[f"{element.name}.mode"] + np.arange(element.mode_count)
            for element in system.elements
            if element.mode_count
        ]
        self.modes = np.concatenate(places)
        y = state_symbols(system.audited_size)
        rates = symbolic.audited_rates(y, hy.time)
        rates = scaled_audit(rates, system.size, hy.par[count + 1])
        self.names = first
        leaving = regularity(y[THETA]) - hy.par[count]
        guards = guards_at(symbolic, y, hy.time)
        events = [leaving, *(g + hy.par[count + 2 + i] for i, g in enumerate(guards))]
        events += symbolic.clearances(y).tolist()
        self.integrator = hy.taylor_adaptive(
            list(zip(y, rates, strict=True)),
            state=[0.0] * len(y),
            tol=tolerance,
            t_events=[hy.t_event(event) for event in events],
            # The code grows with the elements: with eight of them LLVM would compile for minutes.
            compact_mode=len(guards) > MAX_UNROLLED or _is_long(system, len(guards)),
        )


def _is_long(system: System, modes: int) -> bool:
    """Return whether the equations are long: those of a stop beside another element that switches.

    They have the load on the stop, also where the body does not rest there. The equations of a
    manifold are as long with a stop alone.
    """
    has_stop = stop_of(system) is not None
    return has_stop and (modes > 2 or system.coordinates.name == "manifold")


def compiled_modes(system: System, tolerance: float) -> CompiledModes:
    """Return the equations of a system's structure and zeros, compiled once in each thread."""
    named = parameters(system)
    key = CompiledModes, structure(system, named), compiled_zeros(system, named), tolerance
    return compiled_once(key, lambda: CompiledModes(system, tolerance))


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
        self.offsets = np.zeros(len(self.phase.signs))
        self.scale = energy_scale(problem) if scale is None else scale
        # The system would count the states of its elements again at each sample.
        self.size = problem.system.size
        with deadline.paused():
            compiled = compiled_modes(problem.system, problem.rtol)
        self.integrator, self.modes, self.names = (
            compiled.integrator,
            compiled.modes,
            compiled.names,
        )
        self.breakpoints = problem.breakpoints()
        self.reached_breakpoints: list[float] = []
        settings = [problem.range_bound, self.scale, *self.offsets]
        self.values = np.concatenate([parameter_values(self.phase.system), settings])
        self.muted = False
        self.steps = 0
        self.max_step = np.inf
        # A step and its begin may sum up to another last digit than that of a breakpoint.
        self._spacing = 4.0 * float(np.spacing(problem.times[-1]))
        self.samples: list[tuple[float, Array]] = []
        self.systems: list[System] = []
        self._owners = problem.system.clearance_owners
        # A view of the integrator's memory: getting it takes longer than reading it.
        self._state = self.integrator.state
        set_motion(self.integrator, problem.times[0], problem.audited_start())
        self._set_parameters()
        self._add_sample(float(problem.times[0]), problem.audited_start())

    @property
    def phase(self) -> Phase:
        """The current phase."""
        return self.current.phase

    def result(self) -> Trajectory:
        """Integrate, and return the trajectory with the smooth system at each sample."""
        status, reason = RunStatus.COMPLETED, ""
        try:
            self._integrate()
        except StopRun as stop:
            integrator = self.integrator
            state = integrator.state.copy()
            if integrator.time > self.samples[-1][0] and np.isfinite(state).all():
                self._add_sample(integrator.time, state)
            status, reason = stop.status, f"{stop} at t = {self.samples[-1][0]:.9g} s"
        found = trajectory(
            self.problem,
            self._samples_in_joules(),
            status,
            reason,
            self.steps,
            self.steps,
            tuple(self.systems),
            self.reached_breakpoints,
        )
        return self.current.recorded(found)

    def _integrate(self) -> None:
        times = self.problem.times.tolist()
        integrator, last = self.integrator, times[-1]
        if self.current.impacts is not None:
            state = self.current.impacts.begin(integrator.time, integrator.state.copy())
            self._go_on_from(state)
        while len(self.samples) < len(times):
            if self.steps >= self.problem.step_limit:
                raise StopRun(RunStatus.STEP_LIMIT, f"stopped after {self.steps} steps")
            event = self._step(self.breakpoints[0] if self.breakpoints else last)
            reached = bisect_right(times, integrator.time)
            if reached > len(self.samples):
                self._add_samples_of_step(times[len(self.samples) : reached])
            self._check_end(event)
            if self.progress is not None:
                self.progress(integrator.time)
            if len(self.samples) == len(times):
                # A limit reached in the last step does not count.
                return
            if self.deadline.expired():
                raise StopRun(RunStatus.TIME_LIMIT, self.deadline.reason)
            if self.phase.rests:
                integrator.state[:] = self.phase.on_stop(integrator.state.copy())
            if event is not None or self.least_margin < 0:
                self._switch()
            if self.breakpoints and self.breakpoints[0] - integrator.time < self._spacing:
                self._begin_leg(self.breakpoints.pop(0))
            if self.muted:
                self._unmute()

    def _check_end(self, event: int | None) -> None:
        """Stop the run if an event is none of a switch."""
        if event == RANGE_END:
            bound = self.problem.range_bound
            raise StopRun(RunStatus.RANGE_LEFT, f"cos θ2 fell to {bound:g}")
        number = -1 if event is None else event - 1 - len(self.offsets)
        if number >= 0:
            raise zero_length(self._owners[number])

    def _begin_leg(self, t: float) -> None:
        """Begin the legs of the inputs at a breakpoint."""
        assert self.problem.schedule is not None
        self.integrator.time = t
        self.reached_breakpoints.append(t)
        state = self.integrator.state.copy()
        after = self.current.begin_leg(t, state)
        places = self.problem.schedule.places(self.names)
        self.values[places] = self.problem.schedule.legs_at(t)
        self._go_on(state, after)
        if self.samples[-1][0] == t:
            # This sample belongs to the leg that begins, and so to its modes.
            self.systems[-1] = self.phase.system
            self.current.repeat_sample(self.samples[-1][1])

    def _step(self, last: float) -> int | None:
        """Make a step to an event, or of the engine's choice; repeat it if it missed a switch.

        Returns:
            The index of the event; None if the step ended without one.
        """
        integrator, phase = self.integrator, self.phase
        begin, state = integrator.time, self._state.copy()
        while True:
            length = min(self.max_step, last - begin)
            outcome, made = integrator.step(max_delta_t=length, write_tc=True)
            self.steps += 1
            if outcome == NOT_FINITE:
                set_motion(integrator, begin, state)
                raise StopRun(RunStatus.DIVERGED, "the state stopped being finite")
            self.least_margin = phase.least_margin(self._state, integrator.time)
            shorter = shortened(made) if self.least_margin < -MISSED else None
            if self.muted:
                shorter = self._muted_switch(begin, state, shorter)
            if shorter is None:
                break
            set_motion(integrator, begin, state)
            self.max_step = shorter
            if shorter < MIN_STEP:
                raise StopRun(RunStatus.SOLVER_FAILURE, "a switch could not be found")
        # After a missed switch the steps grow again, one by one: it may be the first of several
        # hops at a stop. `flow` has a compiled loop to go back to; this loop has not.
        self.max_step *= STEP_REDUCTION
        index = -1 - outcome.value
        found = 0 <= index <= len(self.offsets) + len(self._owners)
        if 0 < index <= len(self.offsets) and made == 0.0:
            # The step began on a zero of the event function, as after a switch. If it is a double
            # zero, heyoka would find it for ever.
            self.offsets[index - 1], self.muted = MUTED, True
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
            state[:] = integrator.state
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
        self.values[self.modes] = 0.5 * (1.0 + self.phase.signs)
        self.values[-len(self.offsets) :] = self.offsets
        self.muted = bool(self.offsets.any())
        set_parameters(self.integrator, self.values)

    def _add_samples_of_step(self, times: list[float]) -> None:
        """Add the samples at some times within the last step, all of one phase."""
        phase, dense_output = self.phase, self.integrator.update_d_output
        states = [dense_output(t).copy() for t in times]
        if phase.rests:
            states = [phase.on_stop(state) for state in states]
        self.samples += zip(times, states, strict=True)
        self.systems += [phase.system] * len(times)
        self.current.add_samples(states)
        self.deadline.samples = len(self.samples)

    def _add_sample(self, t: float, state: Array) -> None:
        """Add a sample, with audit states as the integrator scales them."""
        self.samples.append((t, state))
        self.systems.append(self.phase.system)
        self.current.add_samples([state])
        self.deadline.samples = len(self.samples)

    def _samples_in_joules(self) -> list[tuple[float, Array]]:
        """Return the samples with their audit states in joules."""
        states = np.array([state for _, state in self.samples])
        states[:, self.size :] *= self.scale
        return [(t, state) for (t, _), state in zip(self.samples, states, strict=True)]
