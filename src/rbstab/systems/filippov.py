"""Filippov's choice of the modes of sliding axes at a state on their surfaces s = F + κE.

Of the axes on their surfaces, each has a force |Λ_i| <= K_s. It moves to positive s only under
-K_s, to negative s only under K_s, and otherwise ṡ_i = 0. With ṡ = WΛ + b these are the conditions
for the least value of ½ Λ'WΛ + b'Λ in the box |Λ_i| <= K_s. W is positive semidefinite, so there is
a least value, and ṡ is the same wherever it is attained.

A body that rests against its stop is one more row, and all rows are chosen together. On the side c,
±1, the couple λ = -cτ presses inwards, the angle leaves inwards, and one of both is zero:

    λ >= 0,    -cθ̈2 >= 0,    λ θ̈2 = 0

With θ̈2 the last entry of WΛ + b these are the conditions for the least value of the same form, with
λ >= 0 as its bound. W stays symmetric and positive semidefinite: it is J M⁻¹ J' of all rows. This
bound is one-sided, but a body that is held has λ = c(b_s + Σ W_si Λ_i)/μ <= U with

    U = (|b_s| + Σ |W_si| K_i)/μ

So the box 0 <= λ <= 2U has the same least value. About its middle it is symmetric, like the others.

Source of the conditions of the contact: D. E. Stewart, SIAM Review 42 (2000) 3-39.
"""

from contextlib import suppress
from typing import Any, NamedTuple

import numpy as np

from rbstab.mechanics import pitch
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import E_OF_W, F_OF_W
from rbstab.systems.impact import jumped, side_of, stop_of
from rbstab.systems.modes import (
    first_mode,
    modes_of,
    with_changed,
    with_contact,
    with_first_modes,
)
from rbstab.systems.surface_forces import Surfaces, elements_with_rows, impulses, surfaces
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
    of_each = [first_mode(system, tie) + np.arange(6).reshape(2, 3) for tie in ties_of(system)]
    return np.concatenate([np.zeros((2, 0), dtype=int), *of_each], axis=1)


def held_axes(system: System) -> Array:
    """Return whether each axis of each tie is held on its surface, shape (rows,)."""
    return np.concatenate([np.zeros(0), *(tie.held for tie in ties_of(system))]) > 0


def alone(system: System) -> frozenset[int]:
    """Return the modes that switch alone: their switch changes no other mode, and no state.

    A motion goes through such a switch. An axis on s = F + κE does not, and a switch beside an axis
    that is held may release it. Beside a stop, modes are chosen together.
    """
    if stop_of(system) is not None or holds_axes(system):
        return frozenset()
    sides_, holds = slide_modes(system)
    others = set(range(len(modes_of(system)))) - set(sides_.tolist()) - set(holds.tolist())
    return frozenset(others | set(sides_[sticky_rows(system)].tolist()))


def idle_holds(system: System) -> tuple[int, ...]:
    """Return the modes that are the holds of axes, if no axis is held; else ().

    Compiled equations leave out all forces that would hold an axis.
    """
    if not slides(system) or holds_axes(system):
        return ()
    return tuple(slide_modes(system)[1].tolist())


def holds_axes(system: System) -> bool:
    """Return whether an axis of a system is held on its surface."""
    return slides(system) and bool(held_axes(system).any())


def at_start(system: System, y: Array, time: float = 0.0) -> System:
    """Return a system in the modes in which a motion begins, also on the surfaces of its ties.

    If the forces of the ties are not determined there, no axis is held. Whether a body rests that
    touches its stop follows from all forces together.

    Args:
        system: The system, in any modes.
        y: The state at the start, of floats.
        time: The time of the start, s.
    """
    system = with_first_modes(system, y, time)
    if not slides(system):
        return system
    side = side_of(system, y)
    touching = system
    if side and abs(residuals(system, y)[-1]) <= START_TOLERANCE:
        touching = with_contact(system, side)
    with suppress(RedundantTiesError):
        return chosen(touching, y, near(system, y), time)[0]
    return system


def near(system: System, y: Array) -> Array:
    """Return the axes on their surfaces at a state, up to `START_TOLERANCE`."""
    motion = system.motion(y)
    distances = [tie.distance(motion) for tie in ties_of(system)]
    return np.flatnonzero(np.concatenate([np.zeros(0), *distances]) <= START_TOLERANCE)


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
    crossed, released = np.isin(slide_modes(system), modes)
    # An axis on s = E has arrived with a rate, and crosses.
    arrived = released | (crossed & ~sticky_rows(system))
    rows = np.flatnonzero(arrived | held_axes(system))
    return chosen(system, y, rows, time)


class Choice(NamedTuple):
    """Filippov's choice for some rows.

    Attributes:
        system: The system in the chosen modes.
        surfaces: The surfaces, without the forces of these rows.
        rows: The rows: axes on their surfaces, and the last row if the body rested.
        sides: 0 for each row that is held, else its side, ±1.
    """

    system: System
    surfaces: Surfaces
    rows: Array
    sides: Array


def chosen(system: System, y: Array, rows: Array, time: float = 0.0) -> tuple[System, Array]:
    """Return a system with Filippov's choice for the axes on their surfaces, and the state.

    A body that rests against its stop takes part, and may be released. The state is moved to s = 0
    on the held axes, and to `RELEASE_OFFSET` on the side to which the other axes leave, by impulses
    at the points of the ties; and to θ̇2 = 0 if the body rested.

    Args:
        system: The system; the modes of all other axes are right.
        y: The state, or the audited state.
        rows: The axes on their surfaces, among those of all ties.
        time: The time, s.

    Raises:
        RedundantTiesError: The forces that hold the axes are not determined.
    """
    if not len(rows) and not resting(system):
        return system, y
    decision = choice(system, y, rows, time)
    return decision.system, moved(decision, y)


def choice(system: System, y: Array, rows: Array, time: float = 0.0) -> Choice:
    """Return Filippov's choice for axes on their surfaces; see `chosen`.

    Args:
        system: As `chosen`.
        y: As `chosen`.
        rows: As `chosen`.
        time: The time, s.
    """
    system, all_surfaces = with_held(system, y, rows, time)
    bounds = bounds_of_axes(system)[rows]
    contact, count = resting(system), len(rows)
    if contact:
        rows = np.append(rows, len(all_surfaces.rates) - 1)
    W, b = all_surfaces.mobility[np.ix_(rows, rows)], all_surfaces.rates[rows]
    if contact:
        most = largest_couple(W, b, bounds)
        bounds, b = np.append(bounds, most), b - contact * most * W[:, -1]
    side = sides(W, b, bounds)
    is_held = side == 0
    if is_held.any() and np.linalg.cond(W[np.ix_(is_held, is_held)]) > 1.0 / SMALLEST_MOBILITY:
        raise RedundantTiesError("the forces of sliding ties are not determined")
    places, holds = slide_modes(system)[:, rows[:count]], is_held[:count]
    system = with_changed(system, places, [side[:count] >= 0, holds])
    if contact and not is_held[-1]:
        system = with_contact(system, 0)
    return Choice(system, all_surfaces, rows, side)


def with_held(system: System, y: Array, rows: Array, time: float) -> tuple[System, Surfaces]:
    """Return a system in which some axes are held, and its surfaces.

    Args:
        system: The system.
        y: The state, or the audited state.
        rows: The axes, among those of all ties.
        time: The time, s.
    """
    system = with_changed(system, slide_modes(system)[:, rows], 1.0)
    motion, pairs = system.loads(y, time)
    return system, surfaces(system.body, system.coordinates, motion, pairs)


def held_at_rest(system: System, y: Array, rows: Array, time: float = 0.0) -> tuple[System, Array]:
    """Return a system in which some axes are held, and the state in which they are at rest.

    Args:
        system: The system.
        y: The state, or the audited state.
        rows: The axes, among those of all ties.
        time: The time, s.
    """
    system, all_surfaces = with_held(system, y, rows, time)
    return system, moved(Choice(system, all_surfaces, rows, np.zeros(len(rows))), y)


def resting(system: System) -> int:
    """Return the side on which the modes of a system say that the body rests, ±1; 0 if none."""
    stop = stop_of(system)
    return 0 if stop is None else int(stop.mode[0] - stop.mode[1])


def largest_couple(W: Array, b: Array, bounds: Array) -> float:
    """Return U, N m, a bound of the couple that holds θ2: (|b_s| + Σ |W_si| K_i)/μ.

    Args:
        W: The mobility of some axes and, last, of θ2.
        b: Their rates under all other forces.
        bounds: K_s of the axes.
    """
    most = float((abs(b[-1]) + np.abs(W[-1, :-1]) @ bounds) / W[-1, -1])
    # Without any load, each bound is right: the couple is zero, and nothing presses.
    return most or 1.0


def sticky_rows(system: System) -> Array:
    """Return which axes stick on s = E, and do not slide on s = F + κE, shape (rows,)."""
    return np.repeat(np.array([tie.sticks for tie in ties_of(system)], dtype=bool), 3)


def sides(W: Array, b: Array, bounds: Array) -> Array:
    """Return Filippov's choice for axes on their surfaces: 0 if it is held, else its side, ±1.

    The choice is that of Λ with the least ½ Λ'WΛ + b'Λ in the box.

    Args:
        W: The mobility of the axes, positive semidefinite, shape (n, n).
        b: Their rates ṡ under all other forces, shape (n,).
        bounds: K_s, shape (n,).

    Returns:
        Shape (n,).
    """
    # In units of the bounds all forces have one size.
    mobility, rates = _definite(np.outer(bounds, bounds) * W), bounds * b
    return pivoted(mobility, rates, np.zeros(len(b)))[0]


def pivoted(mobility: Array, rates: Array, first: Array) -> tuple[Array, Array]:
    """Return the choice of `sides`, and Λ, in units of the bounds, by principal pivots.

    Of the axes that break a condition, the first one is changed, until none does. For a positive
    definite W this ends with the only choice that breaks none.

    Args:
        mobility: W in units of the bounds, positive definite, shape (n, n).
        rates: b in units of the bounds, shape (n,).
        first: The choice with which to begin, shape (n,).

    Source: J. J. Júdice and F. M. Pires, J. Optim. Theory Appl. 74 (1992) 391-411.
    """
    chosen, least = first.copy(), 2.0 * BOUND_TOLERANCE * mobility.diagonal()
    force = -chosen
    for _ in range(MAX_PIVOTS):
        held, force = chosen == 0, -chosen
        if held.any():
            wanted = -(rates + mobility @ force)[held]
            force[held] = np.linalg.solve(mobility[held][:, held], wanted)
        inward = -chosen * (mobility @ force + rates)
        wrong = (inward > least) | (np.abs(force) > 1.0 - BOUND_TOLERANCE) & held
        if not wrong.any():
            break
        axis = int(wrong.argmax())
        chosen[axis] = -np.sign(force[axis]) if held[axis] else 0.0
    return chosen, force


def _definite(W: Array) -> Array:
    """Return a positive semidefinite matrix with its smallest eigenvalues raised."""
    values, vectors = np.linalg.eigh(W)
    return (vectors * np.maximum(values, SMALLEST_MOBILITY * values[-1])) @ vectors.T


def residuals(system: System, y: Array) -> Array:
    """Return what is zero on held rows: s of each axis (F on s = E), then θ̇2 beside a stop."""
    motion = system.motion(y)
    rates = [tie.held_rate(motion) for tie in ties_of(system)]
    if stop_of(system) is not None:
        rates.append(np.array([pitch.rate(motion)]))
    return np.concatenate(rates)


def moved(decision: Choice, y: Array) -> Array:
    """Return the state that belongs to a choice: by impulses, and E on s = E; see `chosen`."""
    system, rows = decision.system, decision.rows
    is_axis = rows < 3 * len(ties_of(system))
    sticky = np.zeros(len(rows), bool)
    sticky[is_axis] = sticky_rows(system)[rows[is_axis]]
    targets = decision.sides * RELEASE_OFFSET
    W = decision.surfaces.mobility[np.ix_(rows, rows)]
    rates = np.where(sticky | ~is_axis, 0.0, targets)
    wanted = rates - residuals(system, y)[rows]
    after = pushed(system, y, rows, np.linalg.lstsq(W, wanted, rcond=SMALLEST_MOBILITY)[0])
    # Only a connector sticks; its E and F are coordinates.
    axes = rows[sticky] % 3
    after[E_OF_W.start + axes], after[F_OF_W.start + axes] = targets[sticky], 0.0
    return after


def pushed(system: System, y: Array, rows: Array, by: Array) -> Array:
    """Return a state after impulses on some rows.

    Args:
        system: The system.
        y: The state, or the audited state.
        rows: The indices of the rows, as in `residuals`.
        by: The impulse on each row, N s or N m s.
    """
    sizes = np.zeros(len(residuals(system, y)), by.dtype)
    sizes[rows] = by
    elements, motion = elements_with_rows(system.elements), system.motion(y)
    return jumped(y, impulses(system.body, system.coordinates, motion, elements, sizes))


def ties_of(system: System) -> list[Any]:
    """Return the elements of a system whose axes slide."""
    return [element for element in system.elements if element.slides]


def bounds_of_axes(system: System) -> Array:
    """Return K_s of each axis of each tie, shape (axes,), N."""
    return np.concatenate([np.zeros(0), *(tie.K_s for tie in ties_of(system))])
