"""The implicit law: fixed steps, with the sign taken at the end of the step.

A step is backward Euler for the connector, Λ ∈ -K_s Sgn(s⁺), and explicit Euler for the smooth
forces. If a force within the bounds ±K_s can hold an axis on the surface, the step ends there, so
there is no chatter. But the step loses the energy of the chatter, and with s = E the time of
sticking depends on the step.

Source: V. Acary, B. Brogliato, Systems & Control Letters 59 (2010) 284-293.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple, Protocol

import numpy as np

from rbstab.integrate.deadline import Deadline
from rbstab.integrate.problem import Problem, Switching
from rbstab.integrate.status import RunStatus
from rbstab.integrate.straight_line.equations import StraightLine
from rbstab.integrate.switch_trace import Transition
from rbstab.integrate.switching.driver import DriverState, Sample, initial_driver_state
from rbstab.integrate.switching.modes import ROUND_OFF, Modes, connector_of, system_for_modes
from rbstab.integrate.switching.switch_log import SwitchLog
from rbstab.mechanics.attitude import regularity
from rbstab.mechanics.numbers import Array, Number
from rbstab.mechanics.states import BODY, E_OF_W, F_OF_W, OMEGA, THETA
from rbstab.systems.coordinates import PartlyHeldCoordinates
from rbstab.systems.system import AUDIT_SIZE, CONTACT_WORK, LYAPUNOV_CHANGE, System

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


class StepResult(NamedTuple):
    """The result of a step in given modes: audited state, and s⁺ and Λ by axis."""

    state: Array
    surface: Array
    force: Array


class Stepper(Protocol):
    """The interface of a function that makes one step in given modes."""

    def __call__(self, y: Array, modes: Modes, h: float) -> StepResult:
        """Make a step of length h from an audited state in coordinates W."""
        ...


def system_for_step(system: System, modes: Modes, h: Number) -> System:
    """Return the system whose held axes reach s⁺ = ρF⁺ + κE⁺ = 0 in one step.

    With F⁺ = F + hḞ and E⁺ = E + hF⁺ this means Ḟ = -F/h - κE/(h(ρ + κh)).
    """
    connector = connector_of(system)
    smooth_system = system_for_modes(system, modes)
    gain = connector.slope / (h * (connector.rate_weight + connector.slope * h))
    coordinates = PartlyHeldCoordinates(np.array(modes.held), 1.0 / h, gain)
    return System(smooth_system.body, smooth_system.elements, coordinates, smooth_system.anchor)


def step(system: System, y: Array, h: Number) -> StepResult:
    """Make one step of a system from `system_for_step`, for any kind of number.

    The velocities are stepped first, then Θ⁺ = Θ + hB(Θ)Ω⁺ and E⁺ = E + hF⁺. The work of Λ is exact
    for the step, h½(F + F⁺)'Λ. ∫v' uses the mean of the old and new velocities.
    """
    rates, force = system.audited_rates(y), system.observe(y).contact_force
    Omega, F = y[OMEGA] + h * rates[OMEGA], y[F_OF_W] + h * rates[F_OF_W]
    E = y[E_OF_W] + h * F
    Theta = y[THETA] + h * (system.motion(y).B @ Omega)
    midpoint = np.concatenate(
        [y[THETA], 0.5 * (y[OMEGA] + Omega), y[E_OF_W], 0.5 * (y[F_OF_W] + F), y[BODY.stop :]]
    )
    lyapunov = y[LYAPUNOV_CHANGE] + h * system.audited_rates(midpoint)[LYAPUNOV_CHANGE]
    work = y[CONTACT_WORK] + h * (midpoint[F_OF_W] @ force)
    state = np.concatenate([Theta, Omega, E, F, np.array([lyapunov, work])])
    return StepResult(state, connector_of(system).surface(E, F), force)


@dataclass(frozen=True)
class _StepInModes:
    """The step in given modes, as a function of a system and of a vector: the state, then h."""

    modes: Modes

    def __call__(self, system: System, x: Array) -> Array:
        """Return the state, s⁺ and Λ, one after the other."""
        y, h = x[:-1], x[-1]
        return np.concatenate(step(system_for_step(system, self.modes, h), y, h))


def python_stepper(system: System) -> Stepper:
    """Return a stepper in Python, without heyoka."""
    size = system.size + AUDIT_SIZE
    steps: dict[Modes, StraightLine] = {}

    def stepper(y: Array, modes: Modes, h: float) -> StepResult:
        if modes not in steps:
            steps[modes] = StraightLine(_StepInModes(modes), system, size + 1)
        value = steps[modes](np.append(y, h))
        return StepResult(value[:size], value[size : size + 3], value[size + 3 :])

    return stepper


class ImplicitDriver:
    """The driver of a run with implicit steps (a `Driver`).

    The steps between two samples are equal, and at most `Switching.step` (to round-off).

    Args:
        problem: The problem.
        switching: The rules for the modes.
        stepper: Makes one step in given modes.
        deadline: The deadline of the run; default one that starts now.
    """

    def __init__(
        self,
        problem: Problem,
        switching: Switching,
        stepper: Stepper,
        deadline: Deadline | None = None,
    ) -> None:
        self.problem, self.switching, self.stepper = problem, switching, stepper
        self.connector = connector_of(problem.system)
        self.K_s = self.connector.K_s.tolist()
        self.on_position = self.connector.rate_weight == 0.0
        self.log = SwitchLog(switching.stored_switches, switching.switch_limit)
        self.steps = self.evaluations = 0
        self.deadline = deadline or Deadline(problem.time_limit)

    def samples(self) -> Iterator[Sample]:
        """Yield the samples in order; the last has a status if the run stopped early."""
        current = initial_driver_state(self.problem, self.switching)
        self.modes = current.modes
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

    def _step_to(self, current: DriverState, end: float) -> DriverState:
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
            status = self._stop_status(after.state)
            current = DriverState(time_reached, after.state, current.modes, status=status)
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
                kind = Transition.STICK if new == 0.0 else Transition.RELEASE
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
