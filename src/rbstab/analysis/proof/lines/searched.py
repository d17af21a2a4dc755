"""Rest states of a body with springs that is not held: by search alone, with no proof.

The length of a spring depends on X then, so X does not leave the energy, and no form of Θ is left.
"""

from dataclasses import dataclass

import numpy as np

from rbstab.analysis.configuration import ORIENTATION, POSITION, Configurations, configurations
from rbstab.analysis.proof.boxes import RANGE_END
from rbstab.analysis.rest_state import RestState, numerical_hessian, rest_state_at
from rbstab.mechanics.numbers import Array
from rbstab.systems.system import System

STARTS = 60

MERGE_DISTANCE = 3e-4
"""rad and m: configurations closer than this count as one."""


@dataclass(frozen=True, eq=False)
class SearchedState:
    """A rest state that a search found.

    Args:
        state: The rest state.
        index: The number of negative eigenvalues of the Hessian of the stored energy.
    """

    state: RestState
    index: int


@np.errstate(all="ignore")  # a search that leaves the range of doubles finds nothing
def searched_rest_states(system: System, seed: int = 0) -> list[SearchedState]:
    """Return the rest states that a root search finds from many attitudes, lowest energy first.

    Args:
        system: The system; its contact point is not held.
        seed: Seed of the random starts; Θ = 0 is added.
    """
    at_rest = configurations(system)
    found: list[Array] = []
    for Theta in [np.zeros(3), *_random_attitudes(seed)]:
        q = _root(at_rest, _at_attitude(at_rest, Theta))
        known = q is None or any(np.abs(q - other).max() < MERGE_DISTANCE for other in found)
        if q is not None and not known:
            found.append(q)
    states = [SearchedState(rest_state_at(at_rest, q), _index(at_rest, q)) for q in found]
    return sorted(states, key=lambda one: one.state.energy)


def _random_attitudes(seed: int) -> Array:
    return np.random.default_rng(seed).uniform(-RANGE_END, RANGE_END, size=(STARTS, 3))


def _at_attitude(at_rest: Configurations, Theta: Array) -> Array:
    """Return the unloaded configuration, turned about the contact point."""
    q = at_rest.unloaded
    q[ORIENTATION] = Theta
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
    return q if np.all(np.isfinite(q)) and rest_state_at(at_rest, q).found else None


def _index(at_rest: Configurations, q: Array) -> int:
    return int(np.sum(np.linalg.eigvalsh(numerical_hessian(at_rest.gradient, q)) < 0))
