"""Impacts of a body against its stop, and when it comes to rest there.

A body that bounces under a load towards the stop makes infinitely many hops in a finite time. Its
hops are followed one by one, until they are lower than `HOP_HEIGHT`. Then it rests.
"""

from typing import Any, NamedTuple

import numpy as np

from rbstab.elements.guards.stop import Stop
from rbstab.mechanics import pitch
from rbstab.mechanics.motion import Motion
from rbstab.mechanics.numbers import Array, Number
from rbstab.mechanics.states import OMEGA, PITCH
from rbstab.systems.surface_forces import impulses
from rbstab.systems.system import System

HOP_HEIGHT = 1e-12
"""rad: a body rests if its next hop, and so every later one, is not higher than this. Coming to
rest discards at most this times the couple that presses the body against the stop, J: 1e-10 J for
100 N m. A hop of this height has some thousand units in the last place of θ2."""


class Impact(NamedTuple):
    """An impact against the stop.

    Attributes:
        state: The state after it.
        rate: θ̇2 before it, rad/s; its sign is that of the side.
        lost: The energy that it takes away, J.
    """

    state: Array
    rate: Number
    lost: Number


def stop_of(system: System) -> Stop | None:
    """Return the stop of a system, or None."""
    return next((element for element in system.elements if isinstance(element, Stop)), None)


def side_of(system: System, y: Array) -> int:
    """Return the side of the stop that θ2 touches or has passed, 1 or -1; 0 if none."""
    stop = stop_of(system)
    angle = float(y[PITCH].real)
    if stop is None or abs(angle) < float(stop.angle) - HOP_HEIGHT:
        return 0
    return 1 if angle > 0 else -1


def impact(system: System, y: Array) -> Impact:
    """Return the impact of a body at its stop. It has no branch: every kind of number will do.

    Args:
        system: The system.
        y: The state, or the audited state; θ2 is at the stop.
    """
    stop, motion = stop_of(system), system.motion(y)
    assert stop is not None
    jump, mobility = response(system, motion)
    rate = pitch.rate(motion)
    state = jumped(y, stop.impulse(rate, mobility) * jump)
    return Impact(state, rate, stop.lost_energy(rate, mobility))


def response(system: System, motion: Motion) -> tuple[Array, Number]:
    """Return what a unit impulse on θ2 does to the body of a system that has a stop.

    Args:
        system: The system.
        motion: The motion; only its pose counts.

    Returns:
        The jump of the coordinates, shape (coordinates.size,), by N m s; and that of θ̇2,
        μ = b'M⁻¹b, 1/(kg m²).
    """
    stop = [stop_of(system)]
    jump = impulses(system.body, system.coordinates, motion, stop, np.ones(1))
    return jump, pitch.direction(motion) @ jump[OMEGA]


def rests(system: System, y: Array, side: int, time: float = 0.0) -> bool:
    """Return whether a body at its stop rests: its next hop is not higher than `HOP_HEIGHT`.

    A hop with the rate θ̇2, against an acceleration α towards the stop, has the height θ̇2²/(2α).

    Args:
        system: The system, in the modes that the other elements have there.
        y: The state, after the impact.
        side: The side, 1 or -1.
        time: The time, s.
    """
    motion, pairs = system.acting(y, time)
    towards = next(side * float(hold[1]) for element, hold in pairs if element.holds)
    return towards > 0 and float(pitch.rate(motion)) ** 2 <= 2.0 * towards * HOP_HEIGHT


def resting_side(system: System, y: Array, time: float = 0.0) -> int:
    """Return the side on which a body rests against its stop, 1 or -1; 0 if it does not.

    Args:
        system: The system, in the modes that the other elements have there.
        y: The state.
        time: The time, s.
    """
    side = side_of(system, y)
    return side if side and rests(system, y, side, time) else 0


def laid_on_stop(system: System, y: Array) -> Array:
    """Return the state with θ2 = ±θ_e and θ̇2 = 0, by an impulse on θ2.

    It is applied when a body comes to rest, and repeated while it rests, since integration errors
    add up. It has no branch, so it accepts every kind of number.

    Args:
        system: The system, in modes in which the body rests.
        y: The state, or the audited state.
    """
    stop = stop_of(system)
    assert stop is not None
    angle = (stop.mode[0] - stop.mode[1]) * stop.angle
    placed = np.concatenate([y[:PITCH], [angle], y[PITCH + 1 :]])
    motion = system.motion(placed)
    jump, mobility = response(system, motion)
    return jumped(placed, -pitch.rate(motion) / mobility * jump)


def jumped(y: Array, jump: Any) -> Array:
    """Return a state whose coordinates have jumped. Own states and audit states do not jump."""
    size = len(jump)
    return np.concatenate([y[:size] + jump, y[size:]])
