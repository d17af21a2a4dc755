"""The chatter of s = E: its energy, and when an axis may be taken to stick."""

from itertools import combinations
from typing import NamedTuple

import numpy as np

from rbstab.integrate.switching.modes import Modes, connector_of, instant, system_under
from rbstab.mechanics.algebra import inverse, quadratic_form
from rbstab.mechanics.constraint import mobility
from rbstab.mechanics.motion import contact_directions
from rbstab.mechanics.numbers import Array, Number
from rbstab.systems.system import System


def bouncing_energy(system: System, y: Array) -> Number:
    """½ F'W⁻¹F, J: the kinetic energy that is in the motion of C, for any kind of number."""
    motion = system.motion(y)
    there = mobility(system.body, contact_directions(system.body, motion))
    return 0.5 * quadratic_form(inverse(there), motion.F)


def chatter_energy(system: System, y: Array) -> float:
    """e = ½ F'W⁻¹F + Σ K_s|E|, J: what the fast bouncing holds.

    Args:
        system: The system, in coordinates W.
        y: The state.
    """
    E = system.motion(y).E
    return float(bouncing_energy(system, y) + connector_of(system).K_s @ np.abs(E))


class Stick(NamedTuple):
    """Axes that were made to stick: the modes and the state after it, and what it cost, J."""

    modes: Modes
    state: Array
    axes: tuple[int, ...]
    discarded: float


def stick(system: System, y: Array, modes: Modes) -> Stick | None:
    """Ends a weak chatter: of as many axes as may stick, or of none.

    A set S may stick where the chatter energy is below a bound and the equivalent force, with
    which Ë_S = 0, is inside the box of every axis of S; the largest such set does. Then E_S is set
    to 0, the impulse -W_SS⁻¹F_S at C takes F_S away, and S is held. That costs about the chatter
    energy: the shift of E moves the springs of the stabilizers a little, too.

    Args:
        system: The system under its modes, in coordinates W.
        y: The state, with the audit states behind it.
        modes: The modes.
    """
    free = [axis for axis in range(3) if not modes.held[axis]]
    for size in range(len(free), 0, -1):
        for axes in combinations(free, size):
            tried = modes
            for axis in axes:
                tried = tried.with_axis(axis, 0.0, held=1.0)
            held = system_under(system, tried)
            # An axis that is held already takes its part of the impulse.
            all_held = [axis for axis in range(3) if tried.held[axis]]
            after = _without_chatter(system, y, all_held)
            force = instant(held, after).force
            if all(abs(force[axis]) <= connector_of(system).K_s[axis] for axis in all_held):
                before = system.observe(y).energy.sum()
                lost = float(before - held.observe(after).energy.sum())
                return Stick(tried, after, axes, lost)
    return None


def _without_chatter(system: System, y: Array, picked: list[int]) -> Array:
    """The state with E_S = 0 on the picked axes S, after the impulse at C that makes F_S = 0."""
    motion, body = system.motion(y), system.body
    c = contact_directions(body, motion)
    mobility_there = mobility(body, c)[np.ix_(picked, picked)]
    impulse = np.zeros(3)
    impulse[picked] = -np.linalg.solve(mobility_there, motion.F[picked])
    jump = body.mass_matrix_inverse @ (c @ impulse)
    Omega, F = motion.Omega + jump[3:6], motion.F + c.T @ jump
    E = motion.E.copy()
    E[picked], F[picked] = 0.0, 0.0
    return np.concatenate([motion.Theta, Omega, E, F, y[12:]])
