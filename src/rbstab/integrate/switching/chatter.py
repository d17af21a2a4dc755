"""The chatter of a sliding connector on the surface s = E: its energy, and its end by sticking."""

import operator
from itertools import combinations
from typing import NamedTuple

import numpy as np

from rbstab.integrate.straight_line.equations import StraightLine
from rbstab.mechanics.algebra import inverse, quadratic_form
from rbstab.mechanics.constraint import mobility
from rbstab.mechanics.motion import contact_directions
from rbstab.mechanics.numbers import Array, Number
from rbstab.mechanics.states import BODY, E_OF_W
from rbstab.systems.connector import connector_of
from rbstab.systems.filippov import held_at_rest, held_axes, sticky_rows
from rbstab.systems.system import System


def contact_kinetic_energy(system: System, y: Array) -> Number:
    """Return ½ F'W⁻¹F, J, the kinetic energy of the contact velocity, with the mobility W."""
    motion = system.motion(y)
    mobility_matrix = mobility(system.body, contact_directions(system.body, motion))
    return 0.5 * quadratic_form(inverse(mobility_matrix), motion.F)


class Chatter:
    """The energy of the chatter, e = ½F'W⁻¹F + Σ K_s|E|, J; W is the mobility.

    It does not depend on the modes of the connector.

    Args:
        system: The system, in coordinates W, in any modes.
    """

    def __init__(self, system: System) -> None:
        self._kinetic = StraightLine(_kinetic_energy, system, BODY.stop)
        self._K_s = connector_of(system).K_s.tolist()

    def energy(self, y: Array) -> float:
        """Return e at an audited state, J."""
        return float(self._kinetic(y[BODY])[0]) + self._potential(y)

    def is_below(self, bound: float, y: Array) -> bool:
        """Return whether the energy at an audited state is below a bound, J."""
        return self._potential(y) < bound and self.energy(y) < bound

    def _potential(self, y: Array) -> float:
        """Return Σ K_s|E|, J."""
        return sum(map(operator.mul, self._K_s, map(abs, y[E_OF_W].tolist())))


def _kinetic_energy(system: System, y: Array) -> Array:
    return np.array([contact_kinetic_energy(system, y)])


class Stick(NamedTuple):
    """Axes that stick: their state and system after it, and the discarded energy, J."""

    axes: tuple[int, ...]
    state: Array
    system: System
    discarded: float


def most_axes_stick(system: System, y: Array, time: float = 0.0) -> Stick | None:
    """Make as many axes as possible stick, to end a weak chatter; return None if no axis may.

    The caller must have tested that the chatter energy is below its bound. A set S of axes may
    stick if the equivalent force, with which Ë_S = 0, is inside the bounds ±K_s of every axis of S.
    The largest such set sticks: E_S is set to 0, the impulse -W_SS⁻¹F_S at C makes F_S = 0, and S
    is held. W is the mobility. The discarded energy is about the chatter energy. It differs a
    little, because the shift of E also changes the energy of the stabilizers.

    Args:
        system: The system, in coordinates W, whose connector sticks. An axis of it that is held
            already takes part.
        y: The audited state.
        time: The time, s.
    """
    of_connector = np.flatnonzero(sticky_rows(system))
    held = held_axes(system)[of_connector]
    free, K_s = np.flatnonzero(~held).tolist(), connector_of(system).K_s
    for size in range(len(free), 0, -1):
        for axes in combinations(free, size):
            all_held = sorted({*np.flatnonzero(held).tolist(), *axes})
            after_it, after = held_at_rest(system, y, of_connector[all_held], time)
            force = after_it.observe(after, time).contact_force
            if all(abs(force[axis]) <= K_s[axis] for axis in all_held):
                before = system.observe(y, time).energy.sum()
                discarded = float(before - after_it.observe(after, time).energy.sum())
                return Stick(axes, after, after_it, discarded)
    return None
