"""The forces that hold axes of sliding ties on their surfaces s = F + κE.

The rates of all surfaces of all ties are ṡ = WΛ + b: W, their mobility, is J M⁻¹ J' with a row of J
for each axis of each tie, and b is the rate without these forces. The axes S that are held have
Λ_S = -W_SS⁻¹ b_S: all of them together, since the force of one moves the points of the others.
"""

from typing import Any, NamedTuple

import numpy as np

from rbstab.elements.element import Element
from rbstab.mechanics import point
from rbstab.mechanics.algebra import ZERO, solved
from rbstab.mechanics.body import Body
from rbstab.mechanics.motion import Motion, Wrench
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import OMEGA
from rbstab.systems.coordinates import Coordinates

Pair = tuple[Element, Array]
"""An element with its own states, or with its equivalent forces if it `slides`."""

UNIT = np.eye(3)
UNIT.flags.writeable = False


class Surfaces(NamedTuple):
    """The surfaces of all sliding ties of a system at a motion, one row for each axis.

    Attributes:
        rates: b, the rates of the surfaces under all other forces, shape (rows,).
        mobility: W, the rates by unit forces, shape (rows, rows).
        held: 1 for each axis that is held, 0 for the others, shape (rows,).
    """

    rates: Array
    mobility: Array
    held: Array

    def forces(self) -> Array:
        """Return Λ, shape (rows,), N: -W_SS⁻¹ b_S on the held axes, 0 on the others.

        The code has no branches: with M = diag(held), the matrix MWM + I - M has the blocks W_SS
        and identity (see `constraint.partial_constraint_force`).
        """
        matrix = np.outer(self.held, self.held) * self.mobility + np.diag(1.0 - self.held)
        return -solved(matrix, self.held * self.rates)


def with_equivalent_forces(
    body: Body, coordinates: Coordinates, motion: Motion, pairs: list[Pair]
) -> list[Pair]:
    """Return the elements of a system, those that `slide` with their equivalent forces.

    Args:
        body: The body.
        coordinates: The coordinates of its motion.
        motion: The motion.
        pairs: All elements with their own states; those that slide with zero forces.
    """
    if not any(element.slides for element, _ in pairs):
        return pairs
    forces = surfaces(body, coordinates, motion, pairs).forces()
    of_ties = iter(forces.reshape(-1, 3))
    return [(element, next(of_ties) if element.slides else own) for element, own in pairs]


def surfaces(body: Body, coordinates: Coordinates, motion: Motion, pairs: list[Pair]) -> Surfaces:
    """Return the surfaces of a system.

    Args:
        body: The body.
        coordinates: The coordinates of its motion.
        motion: The motion.
        pairs: All elements, those that slide with zero equivalent forces.
    """
    ties: list[Any] = [element for element, _ in pairs if element.slides]
    loads = total_wrench(motion, pairs)
    rates = _rates(body, coordinates, motion, loads, ties)
    # Loads change the accelerations of a body at rest as they do those of a moving one.
    still = motion._replace(Omega=ZERO, V=ZERO, E=ZERO, F=ZERO)
    columns = [
        _rates(body, coordinates, still, point.force_at(still, tie.place(body), unit), ties)
        for tie in ties
        for unit in UNIT
    ]
    held = np.concatenate([tie.held for tie in ties])
    return Surfaces(rates, np.array(columns).T, held)


def impulses(
    body: Body, coordinates: Coordinates, motion: Motion, ties: list[Any], sizes: Array
) -> Array:
    """Return the jump of the body's coordinates by impulses at the points of ties.

    Args:
        body: The body.
        coordinates: The coordinates of its motion.
        motion: The motion; only its pose counts.
        ties: The ties.
        sizes: The impulse along each axis of each tie, shape (rows,), N s, inertial.
    """
    still = motion._replace(Omega=ZERO, V=ZERO, E=ZERO, F=ZERO)
    wrenches = [
        point.force_at(still, tie.place(body), sizes[3 * k : 3 * k + 3])
        for k, tie in enumerate(ties)
    ]
    # An impulse does to velocities at rest what the same force does to accelerations.
    jump, _ = coordinates.dynamics(body, still, _sum(wrenches))
    return jump


def total_wrench(motion: Motion, pairs: list[Pair]) -> Wrench:
    """Return the sum of the wrenches of elements."""
    return _sum([element.wrench(motion, own) for element, own in pairs])


def _sum(wrenches: list[Wrench]) -> Wrench:
    force, couple, contact_force = ZERO, ZERO, ZERO
    for wrench in wrenches:
        force, couple = force + wrench.force, couple + wrench.couple
        contact_force = contact_force + wrench.contact_force
    return Wrench(force, couple, contact_force)


def _rates(
    body: Body, coordinates: Coordinates, motion: Motion, loads: Wrench, ties: list[Any]
) -> Array:
    """Return the rates ṡ = F' + κF of all axes of all ties under some loads, shape (rows,)."""
    rates, Lambda_ = coordinates.dynamics(body, motion, loads)
    # Λ is the whole force at the contact point, also what holds it there.
    V_rate = (loads.force + Lambda_) / body.mass
    accelerations = [
        tie.surface_rate(motion, point.acceleration(motion, tie.place(body), rates[OMEGA], V_rate))
        for tie in ties
    ]
    return np.concatenate(accelerations)
