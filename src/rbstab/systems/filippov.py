"""Filippov's choice of the modes of sliding axes at a state on their surfaces s = F + κE.

Of the axes on their surfaces, each has a force |Λ_i| <= K_s. It moves to positive s only under
-K_s, to negative s only under K_s, and otherwise ṡ_i = 0. With ṡ = WΛ + b these are the conditions
for the least value of ½ Λ'WΛ + b'Λ in the box |Λ_i| <= K_s. W is positive semidefinite, so there is
a least value, and ṡ is the same wherever it is attained.
"""

from contextlib import suppress
from typing import Any

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import E_OF_W, F_OF_W
from rbstab.systems.modes import modes_of, with_first_modes, with_modes
from rbstab.systems.surface_forces import Surfaces, impulses, surfaces
from rbstab.systems.system import System

START_TOLERANCE = 1e-12
"""m/s: a start with |s| below this is on the surface."""

RELEASE_OFFSET = 1e-13
"""m/s: the distance from its surface at which an axis is released. It is below the error of the
integration."""

BOUND_TOLERANCE = 1e-9
"""Relative tolerance of the bound K_s of an equivalent force."""

SMALLEST_MOBILITY = 1e-12
"""A mobility that is smaller than this part of the largest one counts as zero: the points of ties
cannot all move freely against each other, since the body is rigid."""


MAX_PIVOTS = 1000
"""The most principal pivots of a choice; one for each axis is the rule."""


class RedundantTiesError(ValueError):
    """The forces on the axes of ties are not determined, because the body is rigid."""


def slides(system: System) -> bool:
    """Return whether a system has sliding ties whose axes may be held on a surface."""
    return any(element.slides for element in system.elements)


def slide_modes(system: System) -> Array:
    """Return the indices among the modes of a system: sides, then holds, of each axis of each tie.

    Returns:
        Shape (2, rows).
    """
    found: list[Array] = [np.zeros((2, 0), dtype=int)]
    begin = 0
    for element in system.elements:
        if element.slides:
            found.append(begin + np.arange(6).reshape(2, 3))
        begin += element.mode_count
    return np.concatenate(found, axis=1)


def at_start(system: System, y: Array, time: float = 0.0) -> System:
    """Return a system in the modes in which a motion begins, also on the surfaces of its ties.

    If the forces of the ties are not determined there, no axis is held.

    Args:
        system: The system, in any modes.
        y: The state at the start, of floats.
        time: The time of the start, s.
    """
    system = with_first_modes(system, y, time)
    if not slides(system):
        return system
    motion = system.motion(y)
    distance = np.concatenate([tie.distance(motion) for tie in _ties(system)])
    with suppress(RedundantTiesError):
        return chosen(system, y, np.flatnonzero(distance <= START_TOLERANCE), time)[0]
    return system


def after_events(
    system: System, y: Array, modes: list[int], time: float = 0.0
) -> tuple[System, Array]:
    """Return a system after events, and the state, with Filippov's choice for its sliding ties.

    An event of another element may change a force by a jump, and so release axes that are held.
    So may a breakpoint of an input, at which no event function has reached zero.

    Args:
        system: The system, in which all other modes have switched already.
        y: The state, or the audited state.
        modes: The indices of the modes whose event functions have reached zero.
        time: The time, s.

    Raises:
        RedundantTiesError: The forces that hold the axes are not determined.
    """
    places = slide_modes(system)
    now = np.array(modes_of(system))
    crossed, released = np.isin(places, modes)
    # An axis on s = E has arrived with a rate, and crosses.
    arrived = released | (crossed & ~_sticky_rows(system))
    rows = np.flatnonzero(arrived | (now[places[1]] > 0))
    return chosen(system, y, rows, time)


def chosen(system: System, y: Array, rows: Array, time: float = 0.0) -> tuple[System, Array]:
    """Return a system with Filippov's choice for the axes on their surfaces, and the state.

    The state is moved to s = 0 on the held axes, and to `RELEASE_OFFSET` on the side to which the
    other axes leave, by impulses at the points of the ties.

    Args:
        system: The system; the modes of all other axes are right.
        y: The state, or the audited state.
        rows: The axes on their surfaces, among those of all ties.
        time: The time, s.

    Raises:
        RedundantTiesError: The forces that hold the axes are not determined.
    """
    if not len(rows):
        return system, y
    places, modes = slide_modes(system), np.array(modes_of(system))
    modes[places[:, rows]] = 1.0
    system = with_modes(system, tuple(modes.tolist()))
    motion, pairs = system.loads(y, time)
    found = surfaces(system.body, system.coordinates, motion, pairs)
    bounds = np.concatenate([e.K_s for e in _ties(system)])[rows]
    W, b = found.mobility[np.ix_(rows, rows)], found.rates[rows]
    side = sides(W, b, bounds)
    is_held = side == 0
    if is_held.any() and np.linalg.cond(W[np.ix_(is_held, is_held)]) > 1.0 / SMALLEST_MOBILITY:
        raise RedundantTiesError("the forces of sliding ties are not determined")
    modes[places[0, rows]] = side >= 0
    modes[places[1, rows]] = is_held
    after = with_modes(system, tuple(modes.tolist()))
    return after, _moved(after, y, found, rows, side * RELEASE_OFFSET)


def _sticky_rows(system: System) -> Array:
    """Return which axes stick on s = E, and do not slide on s = F + κE, shape (rows,)."""
    return np.repeat([tie.sticks for tie in _ties(system)], 3)


def sides(W: Array, b: Array, bounds: Array, tolerance: float = -BOUND_TOLERANCE) -> Array:
    """Return Filippov's choice for axes on their surfaces: 0 if it is held, else its side, ±1.

    The choice is that of Λ with the least ½ Λ'WΛ + b'Λ in the box. It is found by principal pivots:
    of the axes that break a condition, the first one is changed, until none does. For a positive
    definite W this ends with the only choice that breaks none.

    Args:
        W: The mobility of the axes, positive semidefinite, shape (n, n).
        b: Their rates ṡ under all other forces, shape (n,).
        bounds: K_s, shape (n,).
        tolerance: An axis is held if its force is at most K_s times 1 plus this.

    Returns:
        Shape (n,).

    Source: J. J. Júdice and F. M. Pires, J. Optim. Theory Appl. 74 (1992) 391-411.
    """
    # In units of the bounds all forces have one size.
    mobility, rates = _definite(np.outer(bounds, bounds) * W), bounds * b
    least = 2.0 * BOUND_TOLERANCE * np.diag(mobility)
    chosen = np.zeros(len(b))
    for _ in range(MAX_PIVOTS):
        held = chosen == 0
        force = -chosen
        force[held] = np.linalg.solve(
            mobility[np.ix_(held, held)], -(rates + mobility @ force)[held]
        )
        inward = -chosen * (mobility @ force + rates)
        wrong = np.where(held, np.abs(force) > 1.0 + tolerance, inward > least)
        if not wrong.any():
            break
        axis = int(wrong.argmax())
        chosen[axis] = -np.sign(force[axis]) if held[axis] else 0.0
    return chosen


def _definite(W: Array) -> Array:
    """Return a positive semidefinite matrix with its smallest eigenvalues raised."""
    values, vectors = np.linalg.eigh(W)
    return (vectors * np.maximum(values, SMALLEST_MOBILITY * values[-1])) @ vectors.T


def _moved(system: System, y: Array, found: Surfaces, rows: Array, targets: Array) -> Array:
    """Return the state with s moved to targets on some rows: by impulses, and E on s = E."""
    motion, sticky = system.motion(y), _sticky_rows(system)[rows]
    s = np.concatenate([tie.held_rate(motion) for tie in _ties(system)])[rows]
    sizes = np.zeros(len(found.rates))
    W = found.mobility[np.ix_(rows, rows)]
    rates = np.where(sticky, 0.0, targets)
    sizes[rows] = np.linalg.lstsq(W, rates - s, rcond=SMALLEST_MOBILITY)[0]
    jump = impulses(system.body, system.coordinates, motion, _ties(system), sizes)
    moved = np.concatenate([y[: len(jump)] + jump, y[len(jump) :]])
    # Only a connector sticks; its E and F are coordinates.
    axes = rows[sticky] % 3
    moved[E_OF_W.start + axes], moved[F_OF_W.start + axes] = targets[sticky], 0.0
    return moved


def _ties(system: System) -> list[Any]:
    return [element for element in system.elements if element.slides]
