"""The system whose exact motions are enclosed, their starts, and the size of its states."""

from dataclasses import replace

import numpy as np

from rbstab.config.build import Numbers, start_of, system_of
from rbstab.config.schema import Config
from rbstab.config.user_code.permission import has_code, without_code
from rbstab.elements.element import Element
from rbstab.integrate.problem import Problem
from rbstab.mechanics.derivatives import jacobian
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import OMEGA, THETA, V_OF_Z, X_OF_Z
from rbstab.proof.exact.expr import expr, factored
from rbstab.proof.exact.expr import numbers as exact_numbers
from rbstab.proof.motion.monomials import Monomials
from rbstab.proof.motion.motion_set import MotionSet, set_of
from rbstab.systems.coordinates import ReducedCoordinates
from rbstab.systems.modes import modes_of, with_modes
from rbstab.systems.parameters import map_parameters
from rbstab.systems.system import System

MIN_ENERGY = 1e-6
"""J: the energy from which the size of the velocities is computed is at least this."""


def enclosed_system(config: Config, numbers: Numbers) -> System:
    """Return the system of a config in a kind of number; a held body has its six states.

    The exact motion of a held body stays on the submanifold, so these six states describe it.
    Elements of users must have formulas (`not_enclosed`).
    """
    system = system_of(without_code(config), numbers)
    if has_code(config):
        system = _with_users(system, system_of(config), numbers)
    return _with_six_states(system) if system.coordinates.holds_contact else system


def start_set(config: Config, space: Monomials, scale: Array) -> MotionSet | None:
    """Return the set of the starts of a config, the only one; None if it has no bounds.

    Args:
        config: The config; its initial state may have expressions of z.
        space: The monomials in z.
        scale: The size of each state, shape (n,).
    """
    with factored():
        system = enclosed_system(config, exact_numbers)
        start = [expr(entry) for entry in start_of(config, system, exact_numbers)]
    return set_of(start, space, scale)


def state_scale(problem: Problem) -> Array:
    """Return a size of each state of the enclosed system, shape (n,).

    1 rad, the lever of C in m; and speeds at which the kinetic energy is that of the start, or with
    which the stiffest spring swings by these sizes. It decides how long steps are and how frames
    are turned, not what is proved.
    """
    system, start = problem.system, problem.start
    with np.errstate(all="ignore"):
        energy = max(float(np.abs(system.observe(start).energy).sum()), MIN_ENERGY)
    held = system.coordinates.holds_contact
    system = _with_six_states(system) if held else system
    body, scale = system.body, np.ones(system.size)
    scale *= max(float(np.linalg.norm(body.contact_point)), 0.1)
    speeds = [(THETA, OMEGA, np.sqrt(6 * energy / np.trace(body.inertia)))]
    scale[THETA] = 1.0
    if not held:
        speeds.append((X_OF_Z, V_OF_Z, np.sqrt(2 * energy / body.mass)))
    for place, speed, size in speeds:
        scale[speed] = np.maximum(size, _frequency(system, start, place, speed) * scale[place])
    return scale


def _frequency(system: System, start: Array, place: slice, speed: slice) -> float:
    """Return the largest frequency of one kind of motion with all springs taut, 1/s; or zero."""
    stiff = with_modes(system, (1.0,) * len(modes_of(system)))
    body = OMEGA.stop if isinstance(system.coordinates, ReducedCoordinates) else V_OF_Z.stop
    state = np.concatenate([start[:body], start[len(start) - system.size + body :]])
    with np.errstate(all="ignore"):
        J = jacobian(stiff.rates, state)
        square = J[speed, place] @ J[place, speed]
    if not np.isfinite(square).all():
        return 0.0
    return float(np.sqrt(np.abs(np.linalg.eigvals(square)).max()))


def _with_six_states(system: System) -> System:
    return replace(system, coordinates=ReducedCoordinates())


def _with_users(system: System, whole: System, numbers: Numbers) -> System:
    """Return a system with the elements of users of another one, which is in doubles."""
    program_elements, elements = iter(system.elements), list[Element]()
    for element in whole.elements:
        alone = replace(whole, elements=(element,))
        elements += (
            map_parameters(alone, lambda _, values: numbers(values)).elements
            if element.from_user
            else [next(program_elements)]
        )
    return replace(system, elements=tuple(elements))
