"""The rest state that a motion approaches: the Lyapunov function counts from it."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from rbstab.analysis.configuration import Configurations, as_at_rest, configurations
from rbstab.analysis.descents.descent import numerical_hessian
from rbstab.analysis.rest_state import RestState, energy_in, rest_state_below
from rbstab.mechanics.motion import Motion
from rbstab.mechanics.numbers import Array
from rbstab.systems.impact import side_of
from rbstab.systems.system import System

SAME_STATE = 1e-3
"""rad and m: two rest states of equal energy that differ by less are one, found from two starts."""

ENERGY_TOLERANCE = 1e-9
"""Two energies at rest that differ by less, relative to the sum of both plus 1 J, are equal."""


FALLS = 1e-6
"""A curvature of the energy below minus this, relative to the largest entry, is no round-off."""


class LyapunovZero(NamedTuple):
    """The rest state at which v = 0.

    Attributes:
        rest: The rest state.
        approached: Whether the motion approaches it: then v cannot fall below zero, if each force
            on a body at rest is that of the stored energy. Otherwise the descent from the last
            sample stopped at |θ2| = π/2 or found nothing, and `rest` is the rest state nearest to
            the unloaded position.
        is_lowest: Whether no lower rest state is known.
    """

    rest: RestState
    approached: bool
    is_lowest: bool


def lyapunov_zero(
    system: System,
    motion: Motion,
    element_states: Array,
    nearest: RestState,
    is_late: Callable[[], bool] = lambda: False,
) -> LyapunovZero:
    """Return the rest state that a motion approaches: descend in energy from its last sample.

    The potential energy never exceeds the sum of all energies. So v, counted from the state in
    which the descent ends, is not negative at the last sample. It is not negative before either,
    because v does not increase.

    Args:
        system: The smooth system of the problem.
        motion: The last sample of the motion.
        element_states: The own states of the elements there.
        nearest: The rest state nearest to the unloaded position. If the motion approaches it, this
            object itself is returned, so that v does not depend on where the descent began.
        is_late: Returns whether the descent must end now; then it has found nothing.
    """
    acting = as_at_rest(system)
    at_rest = configurations(acting)
    rest = rest_state_below(at_rest, at_rest.configuration(motion, element_states), is_late)
    if rest is None:
        return LyapunovZero(nearest, approached=False, is_lowest=True)
    rest = energy_in(system, rest, acting)
    lower = nearest.is_at_rest and is_lower(nearest.energy, rest.energy)
    higher = nearest.is_at_rest and is_lower(rest.energy, nearest.energy)
    close = nearest.is_at_rest and _distance(at_rest, rest, nearest) < SAME_STATE
    if close and not (lower or higher):
        return LyapunovZero(nearest, approached=True, is_lowest=True)
    return LyapunovZero(rest, approached=True, is_lowest=not lower)


def is_unstable(system: System, rest: RestState) -> bool:
    """Return whether the stored energy falls in some direction from a rest state.

    One against a stop, or where a force jumps, is not known to be unstable.

    Args:
        system: The smooth system of the problem.
        rest: The rest state.
    """
    at_rest = configurations(as_at_rest(system))
    q = at_rest.configuration(rest.motion, rest.element_states)
    if not rest.is_at_rest or rest.on_kink or side_of(system, q):
        return False
    return bool(falls(numerical_hessian(at_rest.gradient, q)[np.newaxis])[0])


def falls(H: Array) -> Array:
    """Return whether energies fall in some direction from where their slope is zero, shape (m,).

    Args:
        H: Their Hessians there, shape (m, n, n). One that is not finite says nothing.
    """
    H = np.where(np.isfinite(H).all(axis=(1, 2), keepdims=True), H, 0.0)
    falling: Array = np.linalg.eigvalsh(H)[:, 0] < -FALLS * np.abs(H).max(axis=(1, 2))
    return falling


def rises(H: Array) -> bool:
    """Return whether an energy rises in all directions from where its slope is zero.

    Args:
        H: Its Hessian there, shape (n, n).
    """
    return bool(np.isfinite(H).all() and np.linalg.eigvalsh(H)[0] > FALLS * np.abs(H).max())


def is_lower(energy: Array | float, other: Array | float) -> Any:
    """Return whether energies at rest, J, are below others, apart from round-off."""
    return energy < other - ENERGY_TOLERANCE * (np.abs(energy) + np.abs(other) + 1.0)


def _distance(at_rest: Configurations, a: RestState, b: RestState) -> float:
    first, second = (at_rest.configuration(rest.motion, rest.element_states) for rest in (a, b))
    return float(np.abs(first - second).max())
