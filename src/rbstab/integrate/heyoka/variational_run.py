"""One integration of a motion and its derivative along a direction, from transition to transition.

Between two transitions modes and legs of inputs are parameters. At each of them state and
derivative may jump (`switching.saltation`).
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rbstab.integrate.heyoka.engine import GRID_END, StepCallback, status_of
from rbstab.integrate.heyoka.integrator_state import set_motion, set_parameters
from rbstab.integrate.heyoka.symbols import parameter_values
from rbstab.integrate.problem import Problem
from rbstab.integrate.status import RunStatus
from rbstab.integrate.switching.course import Course, Transition
from rbstab.integrate.switching.saltation import passed, tangent_at_start
from rbstab.mechanics.derivatives import STEP
from rbstab.mechanics.numbers import Array
from rbstab.systems.modes import modes_of, with_modes
from rbstab.systems.parameters import parameters
from rbstab.systems.system import System

if TYPE_CHECKING:
    from rbstab.integrate.heyoka.variational import VariationalSystem


@dataclass(frozen=True, eq=False)
class Tangent:
    """The direction of the derivative: how a problem changes with s.

    Args:
        system: The system, in any modes. Its parameters have the imaginary part h q, with
            h = `derivatives.STEP`.
        start: z(0), shape (states,).
        rest_energy: The derivative by s of the stored energy of the rest state, J.
    """

    system: System
    start: Array
    rest_energy: float

    def in_modes_of(self, system: System) -> System:
        """Return the system of this direction in the modes of another one."""
        return with_modes(self.system, modes_of(system))

    def parameters_in_modes_of(self, system: System) -> Array:
        """Return q in the modes of a system, in the order of `parameter_values`."""
        values = parameters(self.in_modes_of(system)).values()
        return np.concatenate([np.imag(np.ravel(value)) for value in values]) / STEP


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
        delays: The derivative of the time of each impact by s, by its time, s.

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
        self.size, begin = compiled.size, float(problem.times[0])
        self.delays: dict[float, float] = {}
        z = np.zeros(self.size)
        if tangent is not None:
            first, shifted = course.first, tangent.in_modes_of(course.first)
            z = tangent_at_start(first, shifted, problem.start, tangent.start, begin)
        # ∫v dt and its derivative start at zero.
        set_motion(self.integrator, begin, np.concatenate([problem.start, [0.0], z, [0.0]]))

    def result(self, times: Array) -> tuple[RunStatus, Array]:
        """Integrate, and return the status and the samples, shape (n, states).

        Args:
            times: The samples, s, ascending, the first at the start.
        """
        callback, steps = StepCallback(self.problem, None), 0
        transitions = [one for one in self.course.transitions if one.time < times[-1]]
        edges = [float(times[0]), *(one.time for one in transitions), float(times[-1])]
        # A sample at a transition is that after it.
        rows = [*times.searchsorted(edges[:-1]).tolist(), len(times)]
        systems, samples = self.course.systems, [np.zeros((0, 2 * (self.size + 1)))]
        for leg, (begin, end) in enumerate(pairwise(edges)):
            wanted, is_last = times[rows[leg] : rows[leg + 1]].tolist(), leg == len(transitions)
            # Two transitions may come at one time.
            if begin < end:
                set_parameters(self.integrator, self._parameters(systems[leg]))
                first = int(not wanted or wanted[0] != begin)
                grid = [*([begin] if first else []), *wanted, *([] if is_last else [end])]
                outcome, _, _, taken, _, found = self.integrator.propagate_grid(
                    grid, max_steps=self.problem.step_limit - steps, callback=callback
                )
                steps += taken
                samples.append(found[first : first + len(wanted)])
                if is_last or outcome != GRID_END:
                    break
                if steps >= self.problem.step_limit:
                    callback.status = RunStatus.STEP_LIMIT
                    break
            self._pass(transitions[leg])
        stored = np.concatenate(samples)
        if len(stored) == len(times):
            # A limit reached in the last step does not count.
            return RunStatus.COMPLETED, stored
        return callback.status or status_of(outcome), stored

    def _parameters(self, system: System) -> Array:
        """Return the values of `par[]` in the modes of a system: p, q and s, then the settings."""
        p = parameter_values(system)
        q = np.zeros(len(p)) if self.tangent is None else self.tangent.parameters_in_modes_of(system)
        return np.concatenate([p, q, [0.0], self.settings])

    def _pass(self, transition: Transition) -> None:
        """Go through a transition, at which state and derivative may jump."""
        before, time, states = transition.before, transition.time, self.integrator.state
        shifted = before if self.tangent is None else self.tangent.in_modes_of(before)
        # Each ends with ∫v dt.
        values, derivatives = states[: self.size + 1], states[self.size + 1 :]
        y, z = values[:-1].copy(), derivatives[:-1].copy()
        found = passed(transition, shifted, y, z)
        values[:-1], derivatives[:-1] = found.state, found.tangent
        if transition.impact:
            energies = [
                system.observe(state, time).energy.sum()
                for system, state in ((before, y), (transition.after, found.state))
            ]
            v = [energy - self.settings.rest_energy for energy in energies]
            derivatives[-1] += (v[0] - v[1]) / self.settings.scale * found.delay
            if v[0] >= self.settings.threshold > v[1]:
                self.compiled.zeros[0].append(time)
            self.delays[time] = found.delay
