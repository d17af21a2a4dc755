"""One integration of a motion and its derivative along a direction, from transition to transition.

Between two transitions modes and legs of inputs are parameters. At each of them state and
derivative may jump (`switching.saltation`).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import heyoka as hy
import numpy as np

from rbstab.elements.inputs.signals import Leg
from rbstab.integrate.deadline import Deadline
from rbstab.integrate.heyoka.symbols import parameter_values, set_motion, set_parameters
from rbstab.integrate.problem import Problem
from rbstab.integrate.run import range_left
from rbstab.integrate.status import RunStatus, StopRun
from rbstab.integrate.switching.course import Course, Transition
from rbstab.integrate.switching.saltation import (
    after_breakpoint,
    tangent_at_start,
    through_transition,
)
from rbstab.mechanics.derivatives import STEP
from rbstab.mechanics.numbers import Array
from rbstab.systems.modes import modes_of, with_modes
from rbstab.systems.parameters import parameters
from rbstab.systems.schedule import BEGIN, leg_at, with_legs
from rbstab.systems.system import System

if TYPE_CHECKING:
    from rbstab.integrate.heyoka.variational.equations import VariationalSystem


@dataclass(frozen=True, eq=False)
class Tangent:
    """The direction of the derivative: how a problem changes with s.

    Args:
        system: The system, in any modes and with any legs. Its parameters have the imaginary part
            h q, with h = `derivatives.STEP`.
        start: z(0), shape (states,).
        rest_energy: The derivative by s of the stored energy of the rest state, J.
        legs: The legs of each input that is made of them, with imaginary parts likewise, by name.
    """

    system: System
    start: Array
    rest_energy: float
    legs: Mapping[str, Array]

    def like(self, system: System, time: float) -> System:
        """Return the system of this direction in the modes of a system, with the legs of a time."""
        legs = {name: Leg(*leg_at(legs, time).tolist()) for name, legs in self.legs.items()}
        return with_legs(with_modes(self.system, modes_of(system)), legs)

    def before(self, system: System, time: float) -> System:
        """Return a system with the legs before those that begin at a time, s."""
        earlier = np.nextafter(time, -np.inf)
        legs = {name: Leg(*leg_at(legs, earlier).real.tolist()) for name, legs in self.legs.items()}
        return with_legs(system, legs)

    def delays_at(self, time: float) -> dict[str, float]:
        """Return the derivative of a breakpoint by s for each input whose leg begins there."""
        begins = {name: leg_at(legs, time)[BEGIN] for name, legs in self.legs.items()}
        found = {name: begin for name, begin in begins.items() if begin.real == time}
        return {name: float(begin.imag) / STEP for name, begin in found.items()}


class Passage(NamedTuple):
    """A transition on the way.

    Attributes:
        delay: The derivative of its time by s, s; NaN at a breakpoint of several inputs that do not
            change together for other s.
        energy: The sum of all energies just before it, J.
        energy_slope: The derivative of this number by s, J.
        impact: Whether it is an impact.
    """

    delay: float
    energy: float
    energy_slope: float
    impact: bool


class Settings(NamedTuple):
    """The parameters after those of the system, its direction and s.

    Attributes:
        rest_energy: The stored energy of the rest state, at which v = 0, J.
        rest_slope: Its derivative by s, J.
        scale: The energy scale, J.
        range_bound: The run stops when cos θ2 falls to this value.
        threshold: The value of v whose crossings are recorded, J.
    """

    rest_energy: float
    rest_slope: float
    scale: float
    range_bound: float
    threshold: float


class VariationalRun:
    """One integration of a problem and its derivative.

    Args:
        compiled: The compiled equations.
        problem: The problem; its own samples and tolerances are not used.
        course: The systems of its motion.
        settings: Further parameters.
        tangent: The direction; None for a zero derivative.

    Attributes:
        passages: What is known of the transitions so far, by their time, s.
        rows: The samples so far, each of shape (n, states).

    Raises:
        NotDifferentiableError: The motion has no derivative along the tangent.
    """

    def __init__(
        self,
        compiled: "VariationalSystem",
        problem: Problem,
        course: Course,
        settings: Settings,
        tangent: Tangent | None,
    ) -> None:
        self.compiled, self.integrator = compiled, compiled.integrator
        self.problem, self.course, self.settings = problem, course, settings
        self.tangent = tangent
        self._system = course.first
        self.size, begin = compiled.size, float(problem.times[0])
        self.passages: dict[float, Passage] = {}
        self.rows: list[Array] = []
        self._steps = 0
        z = np.zeros(self.size)
        if tangent is not None:
            first, shifted = course.first, tangent.like(course.first, begin)
            z = tangent_at_start(first, shifted, problem.start, tangent.start, begin)
            # A load that begins at the start begins later for other s.
            change = Transition(begin, (), tangent.before(first, begin), first)
            z = after_breakpoint(change, tangent.delays_at(begin), problem.start, z)
        # ∫v dt and its derivative start at zero.
        set_motion(self.integrator, begin, np.concatenate([problem.start, [0.0], z, [0.0]]))

    def follow(self, times: Array) -> None:
        """Integrate, and keep the samples as `rows`, each of shape (n, states).

        Args:
            times: The samples, s, ascending, the first at the start. One at a transition belongs to
                the equations that begin there.

        Raises:
            StopRun: The run ends early.
        """
        deadline = Deadline(self.problem.time_limit)
        transitions = [one for one in self.course.transitions if one.time < times[-1]]
        edges = [float(times[0]), *(one.time for one in transitions), float(times[-1])]
        firsts = [*times.searchsorted(edges[:-1]).tolist(), len(times)]
        for number, (low, high) in enumerate(pairwise(edges)):
            if number:
                self._pass(transitions[number - 1], self._system)
            system = self.course.systems[number]
            self._system = self._shifted(system, low)
            set_parameters(self.integrator, self._parameters(system, self._system))
            wanted = times[firsts[number] : firsts[number + 1]]
            if low < high:
                self._follow_to(high, wanted, deadline)

    def _follow_to(self, end: float, wanted: Array, deadline: Deadline) -> None:
        """Integrate to a time, s, with some samples on the way."""
        begin, limit = self.integrator.time, self.problem.step_limit
        if self._steps >= limit:
            # heyoka takes a limit of zero for none.
            raise StopRun(RunStatus.STEP_LIMIT, f"stopped after {limit} steps")
        grid = np.unique([begin, *wanted, end])
        outcome, _, _, steps, _, found = self.integrator.propagate_grid(
            grid, max_steps=limit - self._steps, callback=lambda _: not deadline.expired()
        )
        self._steps += steps
        self.rows.append(found[np.isin(grid[: len(found)], wanted)])
        if outcome == hy.taylor_outcome.time_limit:
            return
        raise {
            hy.taylor_outcome.step_limit: StopRun(
                RunStatus.STEP_LIMIT, f"stopped after {limit} steps"
            ),
            hy.taylor_outcome.err_nf_state: StopRun(
                RunStatus.DIVERGED, "the state stopped being finite"
            ),
            hy.taylor_outcome.cb_stop: StopRun(RunStatus.TIME_LIMIT, deadline.reason),
        }.get(outcome, range_left(self.problem))

    def _shifted(self, system: System, time: float) -> System:
        """Return a system shifted along the tangent, with the legs of a time."""
        return system if self.tangent is None else self.tangent.like(system, time)

    def _parameters(self, system: System, shifted: System) -> Array:
        """Return the values of `par[]` for a system: p, q and s, then the settings."""
        q = np.concatenate([np.imag(np.ravel(value)) for value in parameters(shifted).values()])
        return np.concatenate([parameter_values(system), q / STEP, [0.0], self.settings])

    def _pass(self, transition: Transition, shifted: System) -> None:
        """Go through a transition, at which state and derivative may jump.

        Args:
            transition: The transition.
            shifted: The system before it, shifted along the tangent.
        """
        before, time, states = transition.before, transition.time, self.integrator.state
        # Each ends with ∫v dt.
        values, derivatives = states[: self.size + 1], states[self.size + 1 :]
        y, z = values[:-1].copy(), derivatives[:-1].copy()
        if transition.modes:
            found = through_transition(transition, shifted, y, z)
            values[:-1], derivatives[:-1], delay = found
        else:
            delays = {} if self.tangent is None else self.tangent.delays_at(time)
            derivatives[:-1] = after_breakpoint(transition, delays, y, z)
            different = set(delays.values()) or {0.0}
            delay = different.pop() if len(different) == 1 else np.nan
        if not transition.impact and not before.supplies:
            return
        observed = shifted.observe(y + 1j * STEP * z, time)
        energy, power = observed.energy.sum(), (observed.supplied - observed.dissipation).sum()
        change = float(energy.imag) / STEP + float(power.real) * delay
        # Another element may switch at the time of an impact, and after it.
        if transition.impact or time not in self.passages:
            self.passages[time] = Passage(delay, float(energy.real), change, transition.impact)
        if transition.impact:
            left = transition.after.observe(values[:-1], time).energy.sum()
            derivatives[-1] += (energy.real - left) / self.settings.scale * delay
            level = self.settings.threshold + self.settings.rest_energy
            if energy.real >= level > left:
                self.compiled.zeros[0].append(time)
