"""Rest states by search alone, for an energy that is in no proof, or is not proved yet.

A search needs nothing but values of the stored energy, so it takes any element. Where a force jumps
or a stop acts, minima are searched by descents; other rest states by a search for roots.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rbstab.analysis.configuration import (
    ORIENTATION,
    POSITION,
    Configurations,
    as_at_rest,
    configurations,
)
from rbstab.analysis.descents.descent import numerical_hessian
from rbstab.analysis.rest_state import (
    RestState,
    gradient_tolerance,
    in_order,
    largest_load,
    rest_state_at,
    rest_state_below,
)
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import PITCH
from rbstab.systems.impact import stop_of
from rbstab.systems.modes import with_modes_at
from rbstab.systems.system import System

STARTS = 60

SAME = 3e-4
"""rad and m: configurations closer than this count as one."""

DESCENTS = 6
"""The random starts of a search for minima, which takes longer."""

SAME_MINIMUM = 1e-2
"""rad and m: a descent to where a force jumps is less accurate than a root."""

RANGE_END = np.array([np.pi, 0.5 * np.pi, np.pi])

FLAT = 1e-10
"""An energy with a smaller second derivative, relative to the largest, is constant there."""

UNBALANCED = 1e-6
"""The largest acceleration of a body at rest, relative to that under the largest load alone."""


@dataclass(frozen=True, eq=False)
class SearchedState:
    """A rest state that a search found.

    Args:
        state: The rest state.
        index: The number of negative eigenvalues of the Hessian of the stored energy.
    """

    state: RestState
    index: int


def searched_rest_states(system: System) -> list[SearchedState]:
    """Return the rest states that a root search finds from many attitudes, lowest energy first."""

    def rest_state(at_rest: Configurations, start: Array) -> SearchedState | None:
        q = _root(at_rest, start)
        if q is None or not _is_balanced(at_rest, q):
            return None
        bends = np.linalg.eigvalsh(numerical_hessian(at_rest.gradient, q))
        if np.abs(bends).min() <= FLAT * np.abs(bends).max():
            return None  # it is one of a family, such as all attitudes of a free body
        return SearchedState(rest_state_at(at_rest, q), int(np.sum(bends < 0)))

    return _distinct(system, rest_state, _random_attitudes(), SAME)


def searched_minima(system: System) -> list[SearchedState]:
    """Return the minima in which descents from some attitudes end, lowest energy first.

    The body may rest in them where a force jumps, or against a stop.
    """
    stop, attitudes = stop_of(system), _random_attitudes()[:DESCENTS]
    if stop is not None:
        attitudes[:, PITCH] = np.clip(attitudes[:, PITCH], -stop.angle, stop.angle)

    def minimum(at_rest: Configurations, start: Array) -> SearchedState | None:
        state = rest_state_below(at_rest, start)
        if state is None or not state.rests_in_range:
            return None
        q = at_rest.configuration(state.motion, state.element_states)
        held = state.on_kink or (stop is not None and abs(q[PITCH]) >= stop.angle)
        return SearchedState(state, 0) if held or _is_balanced(at_rest, q) else None

    return _distinct(system, minimum, attitudes, SAME_MINIMUM)


@np.errstate(all="ignore")  # a search that leaves the range of doubles finds nothing
def _distinct(
    system: System,
    search: Callable[[Configurations, Array], SearchedState | None],
    attitudes: Array,  # Θ, shape (n, 3), rad
    distance: float,  # closer configurations count as one, rad and m
) -> list[SearchedState]:
    """Return what searches from Θ = 0 and from other attitudes find, lowest energy first."""
    at_rest, places = configurations(as_at_rest(system)), dict[SearchedState, Array]()
    for Theta in [np.zeros(3), *attitudes]:
        state = search(at_rest, _at_attitude(at_rest, Theta))
        if state is not None:
            q = at_rest.configuration(state.state.motion, state.state.element_states)
            if all(np.abs(q - other).max() >= distance for other in places.values()):
                places[state] = q
    return in_order(places, lambda searched: (searched.state.energy, places[searched]))


def _random_attitudes() -> Array:
    return np.random.default_rng(0).uniform(-RANGE_END, RANGE_END, size=(STARTS, 3))


def _at_attitude(at_rest: Configurations, Theta: Array) -> Array:
    """Return the unloaded configuration, turned about the contact point."""
    q = at_rest.unloaded
    q[ORIENTATION] = Theta
    if at_rest.held:
        return q
    contact_point = at_rest.system.body.contact_point
    q[POSITION] += contact_point - at_rest.motion(q).A @ contact_point
    return q


def _root(at_rest: Configurations, start: Array) -> Array | None:
    """Return the rest state that a root search reaches from a configuration, or None."""
    from scipy.optimize import root  # imported late, as in `least_value`

    try:
        # Near the least energy at this Θ: exactly there if the lengths do not matter.
        force, stiffness = at_rest.gradient(start), numerical_hessian(at_rest.gradient, start)
        rest = slice(ORIENTATION.stop, None)
        start[rest] -= np.linalg.solve(stiffness[rest, rest], force[rest])
        q: Array = root(at_rest.gradient, start, tol=1e-12).x
        # A Newton step reaches round-off.
        q = q - np.linalg.solve(numerical_hessian(at_rest.gradient, q), at_rest.gradient(q))
    except (ArithmeticError, ValueError, np.linalg.LinAlgError):
        return None
    return q if np.all(np.isfinite(q)) and rest_state_at(at_rest, q).rests_in_range else None


def _is_balanced(at_rest: Configurations, q: Array) -> bool:
    """Return whether the equations of motion leave the body at rest in a configuration."""
    system, y = at_rest.system, at_rest.state(q)
    # The energy that code of a user states need not be that of its force.
    acceleration = np.abs(with_modes_at(system, y).rates(y)).max()
    inertia = min(float(system.body.mass), float(np.linalg.eigvalsh(system.body.inertia).min()))
    load = largest_load(at_rest, q)
    return bool(acceleration <= UNBALANCED * max(load, gradient_tolerance(load)) / inertia)
