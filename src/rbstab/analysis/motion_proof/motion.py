"""The enclosure of a whole motion, step by step, with its energy."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from rbstab.analysis.motion_proof.dual import Dual, objects
from rbstab.analysis.motion_proof.expansion import NARROW, Accuracy, Expansion
from rbstab.analysis.motion_proof.rounding import (
    error_of_products,
    magnitude_of,
    middle_and_radius,
    rounded_up,
)
from rbstab.analysis.motion_proof.step import StateSet, Step, step_from
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import OMEGA, THETA, V_OF_Z
from rbstab.systems.system import System

PRECISION = 80
"""Bits of a ball. States then have errors far below those of doubles."""

LONGEST_STEP = 0.05
"""s: the first step is at most this long."""

GROWTH = 1.5
"""A step may be longer than the one before by this factor."""

SHORTEST_STEP = 1e-7
"""s: if no step of this length can be proved, the motion is given up."""

MAX_TIME = 2.0**12
"""s: up to here, sums of multiples of 2⁻⁴⁰ s are exact doubles; no enclosure goes on."""

MIN_ENERGY = 1e-6
"""J: the energy from which the scale of the velocities is computed is at least this."""


@contextmanager
def proof_precision() -> Iterator[None]:
    """Return a context in which balls have `PRECISION` bits; motions are enclosed in it."""
    from flint import ctx

    with ctx.workprec(PRECISION):
        yield


@dataclass(frozen=True, eq=False)
class MotionStep:
    """A proved step that begins at `time`, s."""

    time: float
    step: Step

    @property
    def end_time(self) -> float:
        """The time at the end, s. It is exact: steps are multiples of 2⁻⁴⁰ s (see `MAX_TIME`)."""
        return self.time + self.step.h

    def state_at(self, time: float) -> tuple[list[Any], Array]:
        """Return exact numbers near the state at a time of the step, and a bound on the distance.

        Args:
            time: From `self.time` to `self.end_time`, s.
        """
        from flint import arb

        t = arb(time) - self.time
        values, distance = [], np.array(self.step.distance)
        for i, row in enumerate(self.step.p):
            value = arb(0)
            for coefficient in reversed(row):
                value = value * t + coefficient
            values.append(value.mid())
            distance[i] += magnitude_of(value - values[-1])
        return values, rounded_up(distance)


class Unproved(Exception):
    """No further step of a motion could be proved."""


def start_set(start: Array, scale: Array) -> StateSet:
    """Return a set around an initial state of balls.

    Args:
        start: The initial state; its entries are duals or doubles.
        scale: The size of each state, shape (n,).
    """
    from flint import arb

    balls = [entry.value if isinstance(entry, Dual) else arb(float(entry)) for entry in start]
    centre = [ball.mid() for ball in balls]
    radius = np.array(
        [magnitude_of(ball - middle) for ball, middle in zip(balls, centre, strict=True)]
    )
    return StateSet(centre, np.diag(scale), rounded_up(radius / scale))


def enclosed_motion(
    system: System, start: StateSet, scale: Array, accuracy: Accuracy = NARROW
) -> Iterator[MotionStep]:
    """Yield the proved steps of a motion, one after the other, without an end.

    Call it, and use what it yields, in `proof_precision`.

    Args:
        system: The system; its parameters are duals or doubles.
        start: The set of the initial state.
        scale: The size of each state, shape (n,).
        accuracy: How accurate the polynomials are; it has no effect on what is proved.

    Raises:
        Unproved: No step could be proved, because the motion comes near cos θ2 = 0, the set has
            become too large, or the time would exceed `MAX_TIME`.
    """
    time, longest, current = 0.0, LONGEST_STEP, start
    expansion = None
    while True:
        # A shorter step from the same set has the same polynomial.
        expansion = expansion or Expansion(system.rates, current.centre, accuracy)
        step = step_from(system.rates, current, scale, longest, expansion)
        if step is None:
            longest = longest / 2
            if longest < SHORTEST_STEP:
                raise Unproved
            continue
        if time + step.h > MAX_TIME:
            raise Unproved
        yield MotionStep(time, step)
        time, longest, current = time + step.h, GROWTH * step.h, step.end
        expansion = None


def energy_bounds(system: System, states: StateSet) -> tuple[float, float]:
    """Return bounds on the total energy of all states of a set, J.

    E(ȳ + Qw) = E(ȳ) + ∇E·Qw with a gradient between ȳ and ȳ + Qw.

    Args:
        system: The system; its parameters are duals or doubles.
        states: The set.
    """
    from flint import arb

    centre = _total_energy(system, [Dual(entry) for entry in states.centre])
    spread = states.spread.tolist()
    around = [
        Dual(entry + arb(0, extra), {i: arb(1)})
        for i, (entry, extra) in enumerate(zip(states.centre, spread, strict=True))
    ]
    slopes = _total_energy(system, around).slopes
    gradient, rounding = np.zeros(len(spread)), np.zeros(len(spread))
    for index, slope in slopes.items():
        gradient[index], rounding[index] = middle_and_radius(slope)
    size = np.abs(gradient) @ np.abs(states.frame)
    along = np.abs(gradient @ states.frame) + error_of_products(size)
    change = rounded_up(along @ states.radius) + rounded_up(rounding @ states.spread)
    whole = centre.value + arb(0, float(rounded_up(change)))
    return (
        float(np.nextafter(float(whole.lower()), -np.inf)),
        float(np.nextafter(float(whole.upper()), np.inf)),
    )


def _total_energy(system: System, state: list[Dual]) -> Dual:
    energy = sum(system.observe(objects(state)).energy.tolist())
    return energy if isinstance(energy, Dual) else Dual(_ball(energy))


def _ball(value: float) -> Any:
    from flint import arb

    return arb(value)


def angle_bounds(states: StateSet) -> tuple[Array, Array]:
    """Return the smallest and the largest Θ of a set, rounded outwards, each of shape (3,), rad."""
    middle = np.array([float(entry) for entry in states.centre[THETA]])
    error = np.array(
        [magnitude_of(c - m) for c, m in zip(states.centre[THETA], middle, strict=True)]
    )
    reach = rounded_up(states.spread[THETA] + error)
    return np.nextafter(middle - reach, -np.inf), np.nextafter(middle + reach, np.inf)


def scale_of(system: System, energy: float) -> Array:
    """Return a size for each state: 1 rad, the lever of C in m, and speeds at a kinetic energy.

    It decides how long steps are and how frames are turned, not what is proved.

    Args:
        system: The system, in doubles.
        energy: A typical energy above rest, J.
    """
    body, n = system.body, system.size
    energy = max(abs(energy), MIN_ENERGY)
    spin = np.sqrt(2 * energy / (np.trace(body.inertia) / 3))
    speed = np.sqrt(2 * energy / body.mass)
    scale = np.full(n, max(float(np.linalg.norm(body.contact_point)), 0.1))
    scale[THETA], scale[OMEGA] = 1.0, spin
    if not system.coordinates.holds_contact:
        scale[V_OF_Z] = speed
    return scale
