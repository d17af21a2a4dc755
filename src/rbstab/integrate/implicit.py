"""The implicit law of a sliding connector: steps that take the sign at their end.

A step is backward Euler for the connector, Λ ∈ -K_s Sgn(s⁺), and explicit Euler for the smooth
forces. With F⁺ = F + h(Ḟ₀ + WΛ) and E⁺ = E + hF⁺, s⁺ = ρF⁺ + κE⁺ is linear in Λ, s⁺ = MΛ + q. So Λ
is Filippov's choice with M and q in the place of W and b (`systems.filippov`). If a force within
the bounds ±K_s can hold an axis on the surface, the step ends there, so there is no chatter. But
the step loses the energy of the chatter, and with s = E the time of sticking depends on the step.

Source: V. Acary, B. Brogliato, Systems & Control Letters 59 (2010) 284-293.
"""

import math
from dataclasses import replace

import numpy as np

from rbstab.elements.sliding import SlidingConnector
from rbstab.integrate.deadline import Deadline
from rbstab.integrate.problem import Problem, Progress, Trajectory
from rbstab.integrate.run import Run, range_left
from rbstab.integrate.status import RunStatus, StopRun
from rbstab.integrate.straight_line.equations import StraightLine
from rbstab.integrate.switching.records import SwitchRecord
from rbstab.mechanics.attitude import regularity
from rbstab.mechanics.constraint import mobility
from rbstab.mechanics.motion import contact_directions
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import BODY, E_OF_W, F_OF_W, OMEGA, THETA
from rbstab.systems.connector import connector_of, with_law
from rbstab.systems.filippov import pivoted
from rbstab.systems.system import CONTACT_WORK, LYAPUNOV_CHANGE, System

ROUND_OFF = 1e-9
"""Relative tolerance of the number of steps between two samples."""


def with_sides(system: System, sides: Array) -> System:
    """Return a system whose connector exerts Λ = -K_s σ, with σ of each axis in -1 to 1."""
    return with_law(system, SlidingConnector, mode=sides)


def end_of_step(system: System, x: Array) -> Array:
    """Return M, 9 entries, and q of s⁺ = MΛ + q, for a step without Λ; in units of the bounds K_s.

    Args:
        system: The system, whose connector exerts no force.
        x: The audited state, then h.
    """
    y, h, connector = x[:-1], x[-1], connector_of(system)
    weight = connector.rate_weight + connector.slope * h
    F = y[F_OF_W] + h * system.audited_rates(y)[F_OF_W]
    W = mobility(system.body, contact_directions(system.body, system.motion(y)))
    K_s, q = connector.K_s, weight * F + connector.slope * y[E_OF_W]
    return np.concatenate([np.ravel(weight * h * np.outer(K_s, K_s) * W), K_s * q])


def after_step(system: System, x: Array) -> Array:
    """Return the audited state after a step.

    The velocities are stepped first, then Θ⁺ = Θ + hB(Θ)Ω⁺ and E⁺ = E + hF⁺. The work of Λ is exact
    for the step, h½(F + F⁺)'Λ. ∫v' uses the mean of the old and new velocities.

    Args:
        system: The system.
        x: The audited state, then h, then σ of each axis.
    """
    y, h = x[:-4], x[-4]
    system = with_sides(system, x[-3:])
    rates, force = system.audited_rates(y), system.observe(y).contact_force
    Omega, F = y[OMEGA] + h * rates[OMEGA], y[F_OF_W] + h * rates[F_OF_W]
    Theta, E = y[THETA] + h * (system.motion(y).B @ Omega), y[E_OF_W] + h * F
    midpoint = np.concatenate(
        [y[THETA], 0.5 * (y[OMEGA] + Omega), y[E_OF_W], 0.5 * (y[F_OF_W] + F), y[BODY.stop :]]
    )
    lyapunov = y[LYAPUNOV_CHANGE] + h * system.audited_rates(midpoint)[LYAPUNOV_CHANGE]
    work = y[CONTACT_WORK] + h * (midpoint[F_OF_W] @ force)
    return np.concatenate([Theta, Omega, E, F, np.array([lyapunov, work])])


class ImplicitRun(Run):
    """One run with implicit steps, in coordinates W.

    The steps between two samples are equal, and at most `Switching.step` (to round-off).

    Args:
        problem: The problem; its `switching` has a step.
        progress: Called with the time of each sample.
        deadline: The deadline of the run.
    """

    def __init__(self, problem: Problem, progress: Progress | None, deadline: Deadline) -> None:
        super().__init__(problem, progress, deadline, problem.system)
        assert problem.switching is not None
        self.switching, self.connector = problem.switching, connector_of(problem.system)
        self.record = SwitchRecord(problem)
        free, size = with_sides(problem.system, np.zeros(3)), len(self.y)
        self._end = StraightLine(end_of_step, free, size + 1)
        self._after = StraightLine(after_step, free, size + 4)
        motion = problem.system.motion(problem.start)
        s = self.connector.surface(motion.E, motion.F)
        # An axis exactly on the surface has the side that it enters next.
        self.sides = np.where(np.where(s != 0, s, motion.F) >= 0, 1.0, -1.0)
        self.system = with_sides(problem.system, self.sides)
        self._first_energy = self._stored(self.y)

    def result(self) -> Trajectory:
        """Integrate, and return the trajectory with its switches."""
        trajectory = super().result()
        return replace(trajectory, switches=self.record.trace())

    def stops(self) -> list[float]:
        """Return the times of the samples after the first, s."""
        return self.times[1:]

    def follow_to(self, stop: float) -> None:
        """Make equal steps to the next sample, s."""
        begin = self.t
        count = max(1, math.ceil((stop - begin) / self.switching.step * (1.0 - ROUND_OFF)))
        h = (stop - begin) / count
        for k in range(1, count + 1):
            self._step(h, stop if k == count else begin + k * h)
            if regularity(self.y[THETA]) <= self.problem.range_bound:
                raise range_left(self.problem)
            if self.record.total >= self.switching.switch_limit:
                reason = f"stopped after {self.record.total} switches"
                raise StopRun(RunStatus.SWITCH_LIMIT, reason)
            if self.t < self.times[-1]:
                self.check_limits()
        if self.progress is not None:
            self.progress(stop)

    def add_sample(self, t: float, y: Array) -> None:
        """Keep a sample, with its switches and the energy that the steps dissipate."""
        super().add_sample(t, y)
        if self.connector.rate_weight == 0.0:
            # The connector received this energy, but neither stores nor returned it.
            self.record.discarded = self._first_energy - self._stored(y) - float(y[CONTACT_WORK])
        self.record.add_sample(self.sides, y)

    def _stored(self, y: Array) -> float:
        return float(self.connector.K_s @ np.abs(y[E_OF_W]))

    def _step(self, h: float, end: float) -> None:
        """Make one step, to a time, s."""
        sides, shares, after = self.sides, self.sides, None
        if self.sides.all():
            after = self._after(np.concatenate([self.y, [h], shares]))
            surface = self.connector.surface(after[E_OF_W], after[F_OF_W])
            # Most steps end on the side where they began; not a number is on no side.
            after = after if (sides * surface > 0).all() else None
        if after is None:
            sides, shares = self._choice(h)
            after = self._after(np.concatenate([self.y, [h], shares]))
        self.evaluations += 1
        self.steps += 1
        if not math.isfinite(after.sum()):
            raise StopRun(RunStatus.DIVERGED, "the state stopped being finite")
        held = sides == 0
        if held.any():
            # An axis that is held is exactly on its surface.
            E, F, slope = after[E_OF_W], after[F_OF_W], self.connector.slope
            F[held] = (-slope / (self.connector.rate_weight + slope * h) * self.y[E_OF_W])[held]
            E[held] = (self.y[E_OF_W] + h * F)[held]
        if sides is not self.sides:
            self._change(sides, shares, end)
        self.t, self.y = end, after
        self.keep_end()

    def _choice(self, h: float) -> tuple[Array, Array]:
        """Return the side of each axis at the end of a step, 0 if it is held, and its σ."""
        end = self._end(np.append(self.y, h))
        try:
            sides, forces = pivoted(end[:9].reshape(3, 3), end[9:], self.sides)
        except np.linalg.LinAlgError as error:
            raise StopRun(RunStatus.SOLVER_FAILURE, f"a step failed ({error})") from error
        return sides, -forces

    def _change(self, sides: Array, shares: Array, t: float) -> None:
        """Go on with other sides, and other σ, from a time, s, and record what has switched."""
        for axis in np.flatnonzero(sides != self.sides).tolist():
            self.record.add_switch(t, axis)
            if 0.0 in (sides[axis], self.sides[axis]):
                self.record.add_transition(t, axis, held=sides[axis] == 0)
        self.sides, self.system = sides, with_sides(self.problem.system, shares)
