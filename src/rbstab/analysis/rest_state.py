"""Rest states: by descent in potential energy, also against a stop."""

from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from rbstab.analysis.configuration import (
    ORIENTATION,
    Configurations,
    TouchingConfigurations,
    as_at_rest,
    configurations,
)
from rbstab.analysis.descents.descent import descend_from, numerical_hessian
from rbstab.analysis.descents.kinked import descend_to_kinks, has_kinks
from rbstab.elements.guards.barrier import Barrier
from rbstab.mechanics.attitude import in_range, is_upright
from rbstab.mechanics.derivatives import jacobian
from rbstab.mechanics.motion import Motion
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import PITCH
from rbstab.systems.impact import stop_of
from rbstab.systems.system import System

GRADIENT_TOLERANCE = 1e-7
"""N m and N. The energy error is the squared gradient divided by a stiffness.

So this tolerance leaves the energy exact to round-off for every stiffness above 1e-6.
`gradient_tolerance` scales it for loads below 1 N and above 1e5 N.
"""

FORCE_ERROR = 1e-12
"""The round-off of a generalized force, relative to the forces that balance in it."""

MAX_TOUCHES = 4
"""The maximum number of times that a descent goes on along a stop."""

NEAR_STOP = 1e-3
"""rad: a descent that ends this close to a stop goes on along it."""

MAX_POLISHES = 5
"""The maximum number of Newton steps after the descent. One is enough unless loads are extreme."""

LARGEST_PITCH = float(np.nextafter(np.pi / 2, 0.0))
"""rad: the largest |θ2| at which Euler angles are regular."""

AT_POLE = 1e-6
"""rad: a descent that ends so little beyond θ2 = ±90° ends there; θ1 and θ3 stay near those of the
motion."""

SAME_ENERGY = 1e-9
"""Energies are equal if they differ by less, relative to the largest of them: their last bits
differ from one processor to another, and the numbers of rest states must not."""

T = TypeVar("T")


def in_order(rest_states: Iterable[T], key: Callable[[T], tuple[float, Array]]) -> list[T]:
    """Return rest states, lowest energy first; of equal energy, in the order of their places.

    Args:
        rest_states: The rest states.
        key: Returns the energy of one, J, and its place: Θ, rad, or other coordinates.
    """
    given = sorted(((*key(state), state) for state in rest_states), key=lambda entry: entry[0])
    energies = np.array([energy for energy, _, _ in given])
    rises = np.diff(energies) > SAME_ENERGY * np.abs(energies).max(initial=0.0)
    levels = [0, *np.cumsum(rises).tolist()]
    places = [np.round(place, 6).tolist() for _, place, _ in given]
    order = sorted(range(len(given)), key=lambda k: (levels[k], places[k]))
    return [given[k][2] for k in order]


@dataclass(frozen=True, eq=False)
class RestState:
    """The system without velocity in one configuration; a rest state if `is_at_rest`.

    motion has zero velocity. element_states are own states. energy, J, is the energy stored in
    the elements. gradient, N m and N, is the largest remaining generalized force. load, N m and N,
    is the largest of the forces that balance. on_kink is whether a force that jumps there holds the
    body, so that its motion near this state cannot be linearised.
    """

    motion: Motion
    element_states: Array
    energy: float
    gradient: float
    load: float = 1.0
    on_kink: bool = False

    @property
    def is_at_rest(self) -> bool:
        """Whether this is a rest state with |θ2| < π/2; θ1 and θ3 may be any angles."""
        tolerance = max(GRADIENT_TOLERANCE, FORCE_ERROR * self.load)
        return self.gradient <= tolerance and bool(is_upright(self.motion.Theta))

    @property
    def rests_in_range(self) -> bool:
        """Whether this is a rest state inside the range of eq. 5."""
        return self.is_at_rest and bool(in_range(self.motion.Theta))

    @property
    def is_accurate(self) -> bool:
        """Whether the energy is that of a rest state to round-off, also for very small loads."""
        return self.is_at_rest and self.gradient <= gradient_tolerance(self.load)


def nearest_rest_state(system: System) -> RestState:
    """Find a rest state by descent in potential energy from the unloaded position.

    A rest state is a zero of the gradient of the stored energy, over all configurations that the
    connector allows. The descent starts at Θ = 0, X = X_a, own states 0, and ends in a minimum. A
    system can have several rest states; this function does not check that. A stop ends the descent
    in θ2; then the body rests against it. Where the force of an element jumps, the body may rest
    under any force between.

    Returns:
        The state where the descent ended; check `RestState.rests_in_range`.
    """
    acting = as_at_rest(system)
    at_rest = configurations(acting)
    q = at_rest.unloaded
    return energy_in(system, rest_state_below(at_rest, q) or rest_state_at(at_rest, q), acting)


def energy_in(system: System, rest: RestState, acting: System) -> RestState:
    """Return a rest state of `as_at_rest(system)` with the energy that the system stores there.

    Args:
        system: The system.
        rest: The rest state.
        acting: `as_at_rest(system)`. If that is the system itself, the rest state is returned.
    """
    if acting is system:
        return rest
    at_rest = configurations(system)
    energy = float(at_rest.energy(at_rest.configuration(rest.motion, rest.element_states)))
    return replace(rest, energy=energy)


def rest_state_below(
    at_rest: Configurations, q: Array, is_late: Callable[[], bool] = lambda: False
) -> RestState | None:
    """Return the rest state in which a descent from a configuration ends, or None.

    If a stop ends the descent in θ2, it goes on with this θ2. There the body rests if the energy
    falls towards the outside; else the descent goes on inside.

    Args:
        at_rest: The configurations.
        q: The first configuration.
        is_late: Returns whether the descent must end now.
    """
    if not np.isfinite(q).all():
        return None
    stop = stop_of(at_rest.system)
    for _ in range(MAX_TOUCHES):
        state = _descended(at_rest, q, is_late, np.pi / 2 if stop is None else stop.angle)
        q = at_rest.configuration(state.motion, state.element_states)
        if state.is_at_rest or stop is None or abs(q[PITCH]) < stop.angle - NEAR_STOP:
            break
        side = np.sign(q[PITCH])
        touching = TouchingConfigurations(at_rest.system, float(side * stop.angle))
        state = _descended(touching, q, is_late, np.inf)
        q = touching.configuration(state.motion, state.element_states)
        if state.is_at_rest and side * at_rest.gradient(q)[PITCH] <= 0:
            break
    return state if state.is_at_rest else None


def _descended(
    at_rest: Configurations, q: Array, is_late: Callable[[], bool], largest_pitch: float
) -> RestState:
    """Return the state in which a descent ends, at a rest state or at the largest |θ2|."""
    free = not _reads_angles(at_rest, q)

    def is_inside(q: Array) -> Array:
        Theta = q[ORIENTATION]
        inside: Array = is_upright(Theta) & (np.abs(Theta[PITCH]) <= largest_pitch)
        return np.ones_like(inside) if free else inside

    tolerance = gradient_tolerance(largest_load(at_rest, q))
    if has_kinks(at_rest.system):
        at = descend_to_kinks(at_rest, q, tolerance, is_late, is_inside)
        return replace(rest_state_at(at_rest, at.q), gradient=at.gradient, on_kink=at.on_kink)
    end, is_flat = descend_from(lambda _: at_rest.energy, q, tolerance, is_late, is_inside)
    # A rest state from which it begins is kept as it is.
    end = _polished(at_rest, end) if is_flat and np.any(end != q) else end.copy()
    if free:
        end[PITCH] -= 2 * np.pi * np.round(end[PITCH] / (2 * np.pi))
        end = _reflected(end) if abs(end[PITCH]) > np.pi / 2 + AT_POLE else end
        end[PITCH] = np.clip(end[PITCH], -LARGEST_PITCH, LARGEST_PITCH)
    return rest_state_at(at_rest, end)


def _reads_angles(at_rest: Configurations, q: Array) -> bool:
    """Return whether the energy may depend on Θ, and not on the attitude alone."""
    # A stop stores nothing, and a barrier as much on the other side.
    if stop_of(at_rest.system) is not None:
        return True
    if any(
        element.from_user or isinstance(element, Barrier) for element in at_rest.system.elements
    ):
        return True
    # An energy that does not is smooth at θ2 = ±90°, and a descent may go on beyond.
    here, there = (np.asarray(at_rest.energies(place), dtype=float) for place in (q, _reflected(q)))
    return not np.allclose(here, there, rtol=SAME_ENERGY, atol=SAME_ENERGY)


def _reflected(q: Array) -> Array:
    """Return q with other Θ of the same attitude, on the other side of θ2 = ±90°."""
    other = q.copy()
    other[ORIENTATION] += [np.pi, np.copysign(np.pi, q[PITCH]) - 2 * q[PITCH], np.pi]
    return other


def rest_state_at(at_rest: Configurations, q: Array) -> RestState:
    """Return the `RestState` of a configuration q, with its remaining generalized force."""
    steepness, load = _steepness(at_rest, q), largest_load(at_rest, q)
    motion, element_states = at_rest.motion(q), q[at_rest.pose_size :]
    return RestState(motion, element_states, float(at_rest.energy(q)), steepness, load)


def held_at_kink(at_rest: Configurations, state: RestState, normal: Array) -> RestState:
    """Return a rest state that is held where a force jumps, with what is left of all other forces.

    Args:
        at_rest: The configurations.
        state: The state, from `rest_state_at`, on a surface of Θ where a force jumps.
        normal: The direction of this force among the angles, shape (3,).
    """
    q = at_rest.configuration(state.motion, state.element_states)
    forces = np.array(jacobian(at_rest.energy, q), dtype=float).ravel()
    across = normal / np.linalg.norm(normal)
    forces[ORIENTATION] -= (forces[ORIENTATION] @ across) * across
    return replace(state, gradient=float(np.abs(forces).max()), on_kink=True)


def gradient_tolerance(load: float) -> float:
    """Return the gradient, N m and N, at which a descent ends.

    Args:
        load: The largest of the forces that balance at rest, N m and N.
    """
    return max(GRADIENT_TOLERANCE * min(load, 1.0), FORCE_ERROR * load)


def largest_load(at_rest: Configurations, q: Array) -> float:
    """Return the largest generalized force of a single element, N m and N."""
    return float(np.abs(jacobian(at_rest.energies, q)).max(initial=0.0))


def _steepness(at_rest: Configurations, q: Array) -> float:
    return float(np.abs(at_rest.gradient(q)).max())


def _polished(at_rest: Configurations, q: Array) -> Array:
    """Return the end of a descent after Newton steps, which make it exact to round-off."""
    for _ in range(MAX_POLISHES):
        hessian = numerical_hessian(at_rest.gradient, q)
        with suppress(np.linalg.LinAlgError):
            better = q - np.linalg.solve(hessian, at_rest.gradient(q))
            if _steepness(at_rest, better) < _steepness(at_rest, q):
                q = better
                continue
        break
    return q
