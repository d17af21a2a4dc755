"""The implicit law: a fixed step, with the sign taken where the step ends.

Each step is one of backward Euler for the connector, Λ ∈ -K_s Sgn(s⁺), and of explicit Euler for
what is smooth. Wherever the box of Λ can hold it the step ends on the surface, so there is no
chatter; but the energy that the chatter would hold is lost to the step, and with s = E the time of
sticking depends on it.

Source: V. Acary, B. Brogliato, Systems & Control Letters 59 (2010) 284-293.
"""

import math
import time
from collections.abc import Iterator
from itertools import product
from typing import NamedTuple, Protocol

import numpy as np

from rbstab.integrate.problem import Problem, Switching
from rbstab.integrate.status import RunStatus
from rbstab.integrate.switch_trace import Transition
from rbstab.integrate.switching.driver import Reached, Sample, at_start
from rbstab.integrate.switching.modes import ROUND_OFF, Modes, connector_of, system_under
from rbstab.integrate.switching.switch_log import SwitchLog
from rbstab.mechanics.attitude import regularity
from rbstab.mechanics.numbers import Array, Number
from rbstab.systems.coordinates import PartlyHeldCoordinates
from rbstab.systems.system import System

SIDES = [(a, b, c) for a, b, c in product((1.0, -1.0, 0.0), repeat=3)]
"""Every combination of sides of three axes, 0 for one that is held."""


def _nearest(mode: tuple[float, float, float]) -> list[Modes]:
    """All modes, those first that differ from the given ones on few axes."""
    ordered = sorted(SIDES, key=lambda sides: int(np.sum(np.array(sides) != mode)))
    return [
        Modes(sides, held=(float(sides[0] == 0), float(sides[1] == 0), float(sides[2] == 0)))
        for sides in ordered
    ]


NEAREST = {sides: _nearest(sides) for sides in SIDES}
"""The order in which modes are tried, by the modes before."""

CLOCK_EVERY = 64
"""Steps between two looks at the clock."""


class Stepped(NamedTuple):
    """Where a step ends, if its choice of modes is right: audited state, s⁺ and Λ, by axis."""

    state: Array
    surface: Array
    force: Array


class Stepper(Protocol):
    """Makes one step of given length under given modes."""

    def __call__(self, y: Array, modes: Modes, h: float) -> Stepped:
        """The step from an audited state in coordinates W."""
        ...


def system_for_step(system: System, modes: Modes, h: Number) -> System:
    """The system whose held axes reach s⁺ = ρF⁺ + κE⁺ = 0 in one step.

    With F⁺ = F + hḞ and E⁺ = E + hF⁺ that is Ḟ = -F/h - κE/(h(ρ + κh)).
    """
    connector = connector_of(system)
    under = system_under(system, modes)
    gain = connector.slope / (h * (connector.rate_weight + connector.slope * h))
    coordinates = PartlyHeldCoordinates(np.array(modes.held), 1.0 / h, gain)
    return System(under.body, under.elements, coordinates, under.anchor)


def step(system: System, y: Array, h: Number) -> Stepped:
    """One step of a system of `system_for_step`, for any kind of number.

    The velocities first, then Θ⁺ = Θ + hB(Θ)Ω⁺ and E⁺ = E + hF⁺. The work of Λ is exact for it,
    h½(F + F⁺)'Λ; ∫v' takes the velocities half way.
    """
    rates, force = system.audited_rates(y), system.observe(y).contact_force
    Omega, F = y[3:6] + h * rates[3:6], y[9:12] + h * rates[9:12]
    E = y[6:9] + h * F
    Theta = y[0:3] + h * (system.motion(y).B @ Omega)
    middle = np.concatenate([y[0:3], 0.5 * (y[3:6] + Omega), y[6:9], 0.5 * (y[9:12] + F), y[12:]])
    lyapunov = y[12] + h * system.audited_rates(middle)[12]
    work = y[13] + h * (middle[9:12] @ force)
    state = np.concatenate([Theta, Omega, E, F, np.array([lyapunov, work])])
    return Stepped(state, connector_of(system).surface(E, F), force)


def plain_stepper(system: System) -> Stepper:
    """Steps by numpy."""

    def stepper(y: Array, modes: Modes, h: float) -> Stepped:
        return step(system_for_step(system, modes, h), y, h)

    return stepper


class ImplicitDriver:
    """One run by implicit steps (a `Driver`).

    Between two samples the steps are equal, and `Switching.step` or a little less.
    """

    def __init__(self, problem: Problem, switching: Switching, stepper: Stepper) -> None:
        self.problem, self.switching, self.stepper = problem, switching, stepper
        self.connector = connector_of(problem.system)
        self.K_s = self.connector.K_s.tolist()
        self.on_position = self.connector.rate_weight == 0.0
        self.log = SwitchLog(switching.stored_switches, switching.switch_limit)
        self.failure = "no choice of modes is consistent"
        self.steps = self.evaluations = 0
        self.deadline = time.monotonic() + problem.time_limit

    def samples(self) -> Iterator[Sample]:
        """The samples one after the other; the last has a status where the run stopped early."""
        now = at_start(self.problem, self.switching)
        self.modes = now.modes
        potential = self._potential(now.state)
        yield Sample(now, tuple(self.log.counts), 0.0)
        for end in self.problem.times[1:].tolist() if now.status is None else []:
            now = self._to(now, end)
            # What the connector took and neither holds nor gave back: the damping of the steps.
            damped = potential - self._potential(now.state) - float(now.state[-1])
            yield Sample(now, tuple(self.log.counts), damped if self.on_position else 0.0)
            if now.status is not None:
                return

    def _potential(self, y: Array) -> float:
        return float(self.connector.K_s @ np.abs(y[6:9]))

    def _to(self, now: Reached, end: float) -> Reached:
        """Equal steps to a sample, or to the step at which the run ends."""
        begin = now.time
        count = max(1, math.ceil((end - begin) / self.switching.step * (1.0 - ROUND_OFF)))
        h = (end - begin) / count
        for k in range(1, count + 1):
            modes, after = self._choice(now.state, h)
            self.steps += 1
            if not np.isfinite(after.state).all():
                return now._replace(status=RunStatus.DIVERGED)
            time_reached = end if k == count else begin + k * h
            self._note(time_reached, modes)
            status = self._status(after.state)
            now = Reached(time_reached, after.state, now.modes, status=status)
            if k == count or status is not None:
                break
        # The modes of a sample are the shares of its bounds that the last force had.
        share = np.clip(-after.force / self.connector.K_s, -1.0, 1.0)
        shares = np.where(np.array(self.modes.held) == 1.0, share, self.modes.mode)
        return now._replace(modes=Modes((shares[0], shares[1], shares[2])))

    def _choice(self, y: Array, h: float) -> tuple[Modes, Stepped]:
        """The step whose modes are consistent: there is one, for W is positive definite.

        Those most like the modes before are tried first.
        """
        # By how many newtons s⁺ is wrong, roughly: it only breaks ties.
        weight = self.connector.rate_weight + self.connector.slope * h
        scale = self.problem.system.body.mass / (h * weight)
        found: tuple[float, Modes, Stepped] | None = None
        for modes in NEAREST[self.modes.mode]:
            after = self.stepper(y, modes, h)
            self.evaluations += 1
            violation = self._violation(modes, after, scale)
            if found is None or violation < found[0]:
                found = violation, modes, after
            if violation <= ROUND_OFF:
                break
        assert found is not None
        return found[1], found[2]

    def _violation(self, modes: Modes, after: Stepped, scale: float) -> float:
        """By which part of K_s the force of an axis breaks the law Λ ∈ -K_s Sgn(s⁺)."""
        surface, force = after.surface.tolist(), after.force.tolist()
        worst = 0.0
        for side, s, f, K_s in zip(modes.mode, surface, force, self.K_s, strict=True):
            wrong = abs(f) / K_s - 1.0 if side == 0.0 else -side * s * scale / K_s
            if not wrong <= worst:
                worst = wrong
        return worst

    def _note(self, time_reached: float, modes: Modes) -> None:
        for axis, (old, new) in enumerate(zip(self.modes.mode, modes.mode, strict=True)):
            if new == old:
                continue
            self.log.switch(time_reached, axis)
            if 0.0 in (old, new):
                what = Transition.STICK if new == 0.0 else Transition.RELEASE
                self.log.transition(time_reached, axis, what)
        self.modes = modes

    def _status(self, y: Array) -> RunStatus | None:
        if regularity(y[0:3]) <= self.problem.range_bound:
            return RunStatus.RANGE_LEFT
        if self.log.total >= self.switching.switch_limit:
            return RunStatus.SWITCH_LIMIT
        if self.steps >= self.problem.step_limit:
            return RunStatus.STEP_LIMIT
        late = self.steps % CLOCK_EVERY == 0 and time.monotonic() > self.deadline
        return RunStatus.TIME_LIMIT if late else None
