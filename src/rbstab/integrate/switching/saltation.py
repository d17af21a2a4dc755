"""The derivative of a motion by a parameter, where the motion switches.

Let y obey ẏ = f⁻ until its event function g reaches zero. There it may jump to h(y), as in an
impact; then it obeys ẏ = f⁺. If a parameter grows by ds, the switch is later by dτ. In this time
the motion follows f⁻ and not f⁺. So z = ∂y/∂s jumps at the switch:

    z⁺ = ∂h/∂y (z⁻ + f⁻ dτ/ds) + ∂h/∂s - f⁺ dτ/ds,    dτ/ds = -(∂g/∂y z⁻ + ∂g/∂s) / ġ⁻

Here ġ⁻ is the rate of g along f⁻. Where y does not jump and the force is continuous, z does not
jump either. A motion that only touches g = 0, where the force jumps, has no finite derivative.

An axis that is held from the start has its switch at the start. So z(0) is projected onto the
tangent space of the surface, along the direction of the force of this axis. It is that of f⁻ - f⁺
on either side of the surface, so z does not depend on the side.

Source: R. I. Leine and H. Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems
(2004), ch. 7 (the saltation matrix).
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from rbstab.elements.inputs.signals import Leg
from rbstab.integrate.switching.course import Transition
from rbstab.mechanics.derivatives import STEP
from rbstab.mechanics.numbers import Array
from rbstab.systems.filippov import (
    held_axes,
    holds_axes,
    pushed,
    residuals,
    resting,
    slide_modes,
    with_held,
)
from rbstab.systems.impact import impact as impact_of
from rbstab.systems.impact import laid_on_stop, stop_of
from rbstab.systems.modes import guards_at, mode_owners, modes_of, with_changed, with_modes
from rbstab.systems.schedule import with_legs
from rbstab.systems.system import System

CONTINUOUS = 1e-9
"""Rates that differ by less, relative to the largest one, do not jump: at the release of an axis
they are equal up to the error of its force (`systems.filippov.BOUND_TOLERANCE`)."""


class NotDifferentiableError(ValueError):
    """The motion has no derivative by the numbers of its config."""


class AfterTransition(NamedTuple):
    """A motion after a transition.

    Attributes:
        state: y.
        tangent: z = ∂y/∂s, in the shape of y.
        delay: dτ/ds, the derivative of the time of the transition; 0 if the rates are continuous.
    """

    state: Array
    tangent: Array
    delay: float


def through_transition(
    transition: Transition, shifted: System, y: Array, z: Array
) -> AfterTransition:
    """Return a motion after a transition.

    Args:
        transition: The transition.
        shifted: The system before it, whose parameters have the imaginary part h ∂p/∂s, with
            h = `derivatives.STEP`.
        y: The state before it.
        z: ∂y/∂s before it, in the shape of y.

    Raises:
        NotDifferentiableError: y or its rates jump, and two modes switch at the same time.
    """
    time, _, before, after, impact = transition
    rates = before.rates(y, time)
    if not impact:
        jump = rates - after.rates(y, time)
        if np.abs(jump).max() <= CONTINUOUS * np.abs(rates).max():
            return AfterTransition(y, z, 0.0)
    delay = _delay(transition, shifted, y, z, rates)
    at_switch = y + 1j * STEP * (z + rates * delay)
    if impact:
        at_switch = _after_impact(transition, shifted, at_switch)
    state = at_switch.real
    return AfterTransition(state, at_switch.imag / STEP - after.rates(state, time) * delay, delay)


def after_breakpoint(
    transition: Transition, delays: Mapping[str, float], y: Array, z: Array
) -> Array:
    """Return z after a breakpoint of inputs; y does not jump there.

    Loads are added to each other. So z jumps by (f⁻ - f⁺) dτ/ds of each input whose leg begins
    there, where f⁺ has the new leg of this input alone.

    Args:
        transition: The transition.
        delays: dτ/ds for each input whose leg begins there, by name.
        y: The state.
        z: ∂y/∂s before it, in the shape of y.

    Raises:
        NotDifferentiableError: Modes switch too, and dτ/ds differs between the inputs.
    """
    time, _, before, after, _ = transition
    if not any(delays.values()):
        return z
    rates = before.rates(y, time)
    if modes_of(before) == modes_of(after):
        inputs: list[Any] = [element for element in after.elements if element.name in delays]
        new: dict[str, Leg] = {element.name: element.signal for element in inputs}
        jumps = [
            (rates - with_legs(before, {name: new[name]}).rates(y, time)) * delay
            for name, delay in delays.items()
        ]
        return z + sum(jumps)
    if len(set(delays.values())) > 1:
        names = " and ".join(delays)
        raise NotDifferentiableError(
            f"{names}: change at t = {time:.9g} s, where another element switches too, so that the "
            "motion has no derivatives (expected changes at different times)"
        )
    moved: Array = z + (rates - after.rates(y, time)) * next(iter(delays.values()))
    return moved


def _delay(transition: Transition, shifted: System, y: Array, z: Array, rates: Array) -> float:
    """Return dτ/ds; see `through_transition`."""
    time, modes, before, *_ = transition
    owners = mode_owners(before)
    if len(modes) > 1:
        names = " and ".join(dict.fromkeys(owners[mode] for mode in modes))
        raise NotDifferentiableError(
            f"{names}: {len(modes)} switches come at once at t = {time:.9g} s, so that the motion "
            "has no derivatives (expected switches one after another)"
        )
    (mode,) = modes
    rate = guards_at(before, y + 1j * STEP * rates, time + 1j * STEP)[mode].imag
    return float(-guards_at(shifted, y + 1j * STEP * z, time)[mode].imag / rate)


def _after_impact(transition: Transition, shifted: System, y: Array) -> Array:
    """Return h(y): the state after an impact, at rest against the stop if the body rests then."""
    y = impact_of(shifted, y).state
    after = with_modes(shifted, modes_of(transition.after))
    stop = stop_of(after)
    assert stop is not None
    if stop.mode.any():
        y = laid_on_stop(after, y)
    # Each impact throws axes off their surfaces. Those that are held are back with the last hop.
    return _on_surfaces(after, y, transition.time) if holds_axes(after) else y


def tangent_at_start(system: System, shifted: System, y: Array, z: Array, time: float) -> Array:
    """Return z at the start, tangent to the surfaces on which axes are held there.

    Args:
        system: The system at the start.
        shifted: The system with the parameters shifted, as for `through_transition`.
        y: The state.
        z: The derivative of the initial state, in the shape of y.
        time: The time, s.

    Raises:
        NotDifferentiableError: The start lies on a border where the rates jump, and the derivative
            leads across it; or an axis is held on s = E, from which it would bounce.
    """
    _check_borders(system, shifted, y, z, time)
    if not holds_axes(system):
        return z
    if any(element.slides and getattr(element, "sticks", False) for element in system.elements):
        raise NotDifferentiableError(
            "an axis is held on s = E from the start: from a start beside it, it would bounce "
            "(expected a surface with a slope, or another start)"
        )
    return _on_surfaces(shifted, y + 1j * STEP * z, time).imag / STEP


def _on_surfaces(shifted: System, y: Array, time: float) -> Array:
    """Return a state moved by impulses along the held axes until it is on their surfaces."""
    # `shifted` is as for `through_transition`; the imaginary part of y is h ∂y/∂s.
    axes = np.flatnonzero(held_axes(shifted))
    _, surfaces = with_held(shifted, y, axes, time)
    away = residuals(shifted, y)
    # The impulses must not move a body away from the stop at which it rests: the last row.
    rows = np.append(axes, len(away) - 1) if resting(shifted) else axes
    away = away[rows]
    # Impulses change velocities alone, and s is linear in these. So one step is exact.
    return pushed(shifted, y, rows, -np.linalg.solve(surfaces.mobility[np.ix_(rows, rows)], away))


def _check_borders(system: System, shifted: System, y: Array, z: Array, time: float) -> None:
    """Reject a start on a border at which the rates jump, if s leads across it; see above."""
    guards, owners = guards_at(system, y, time), mode_owners(system)
    changes = guards_at(shifted, y + 1j * STEP * z, time).imag
    rates = system.rates(y, time)
    # The borders of axes that are held are no such borders.
    is_free = np.ones(len(guards), dtype=bool)
    is_free[slide_modes(system)[:, held_axes(system)]] = False
    for mode in np.flatnonzero((guards == 0) & (changes != 0) & is_free):
        flipped = with_changed(system, mode, 1.0 - modes_of(system)[mode])
        jump = flipped.rates(y, time) - rates
        if np.abs(jump).max() > CONTINUOUS * np.abs(rates).max():
            raise NotDifferentiableError(
                f"{owners[mode]}: the start lies where its force jumps, so that the motion has no "
                "derivatives (expected a start beside this border)"
            )
