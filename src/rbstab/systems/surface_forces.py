"""The forces that hold axes of sliding ties on their surfaces s = F + κE, and θ2 at a stop.

The rates of all surfaces of all ties are ṡ = WΛ + b: W, their mobility, is J M⁻¹ J' with a row of J
for each axis of each tie, and b is the rate without these forces. The axes S that are held have
Λ_S = -W_SS⁻¹ b_S: all of them together, since the force of one moves the points of the others.

A stop is one more row: its rate is θ̈2, its force is the couple τ on θ2, and its row of J is b' of
`mechanics.pitch`. While the body rests there it is held like an axis, and solved with them.
"""

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from rbstab.elements.element import Element, couple_on_body
from rbstab.mechanics import pitch, point
from rbstab.mechanics.algebra import ZERO, solved
from rbstab.mechanics.body import Body
from rbstab.mechanics.motion import Motion, Wrench
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import OMEGA
from rbstab.systems.coordinates import Coordinates

Pair = tuple[Element, Array]
"""An element with its own states, or with its equivalent forces if it `slides`, or its hold."""


class Surfaces(NamedTuple):
    """The surfaces of all sliding ties of a system at a motion, one row for each axis.

    If an element `holds` θ2, a last row is that of θ̇2, with a couple in place of a force.

    Attributes:
        rates: b, the rates of the surfaces under all other forces, shape (rows,).
        mobility: W, the rates by unit forces, shape (rows, rows).
        held: 1 for each row that is held, 0 for the others, shape (rows,).
    """

    rates: Array
    mobility: Array
    held: Array

    def forces(self) -> Array:
        """Return Λ, shape (rows,), N: -W_SS⁻¹ b_S on the held axes, 0 on the others.

        The code has no branches: with M = diag(held), the matrix MWM + I - M has the blocks W_SS
        and identity.
        """
        matrix = np.outer(self.held, self.held) * self.mobility + np.diag(1.0 - self.held)
        return -solved(matrix, self.held * self.rates)

    def hold(self, forces: Array) -> Array:
        """Return the hold [τ, α] of θ2, N m and rad/s², under the forces of all ties.

        α is θ̈2 under all forces but the couple. Since θ̈2 = α + μτ, the couple that makes it zero is
        τ = -α/μ. While the body rests, this is the τ of `forces`.

        Args:
            forces: Λ, shape (rows,).
        """
        acceleration = self.rates[-1] + self.mobility[-1, :-1] @ forces[:-1]
        return np.array([-acceleration / self.mobility[-1, -1], acceleration])


def with_equivalent_forces(
    body: Body, coordinates: Coordinates, motion: Motion, pairs: list[Pair]
) -> list[Pair]:
    """Return the elements of a system, those that `slide` with their equivalent forces.

    One that `holds` gets its hold, which is solved together with them.

    Args:
        body: The body.
        coordinates: The coordinates of its motion.
        motion: The motion.
        pairs: All elements with their own states; those that slide or hold with zero forces. There
            is one of them at least.
    """
    all_surfaces = surfaces(body, coordinates, motion, pairs)
    size = 3 * sum(element.slides for element, _ in pairs)
    # The couple of a stop alone needs no solution of equations.
    forces = all_surfaces.forces() if size else np.zeros(1)
    of_ties = iter(forces[:size].reshape(-1, 3))
    hold = all_surfaces.hold(forces) if any(element.holds for element, _ in pairs) else ZERO
    return [
        (element, next(of_ties) if element.slides else hold if element.holds else states)
        for element, states in pairs
    ]


def surfaces(body: Body, coordinates: Coordinates, motion: Motion, pairs: list[Pair]) -> Surfaces:
    """Return the surfaces of a system.

    Args:
        body: The body.
        coordinates: The coordinates of its motion.
        motion: The motion.
        pairs: All elements, those that slide or hold with zero forces.
    """
    rows = elements_with_rows(element for element, _ in pairs)
    loads = total_wrench(motion, pairs)
    rates = _rates(body, coordinates, motion, loads, rows)
    # Loads change the accelerations of a body at rest as they do those of a moving one.
    still = at_rest(motion)
    units = [
        _load(body, still, element, unit) for element in rows for unit in np.eye(_count(element))
    ]
    columns = [_rates(body, coordinates, still, unit, rows) for unit in units]
    held = np.concatenate([_held(element) for element in rows])
    return Surfaces(rates, np.array(columns).T, held)


def at_rest(motion: Motion) -> Motion:
    """Return a motion without velocities."""
    return motion._replace(Omega=ZERO, V=ZERO, E=ZERO, F=ZERO)


def impulses(
    body: Body, coordinates: Coordinates, motion: Motion, rows: list[Any], sizes: Array
) -> Array:
    """Return the jump of the body's coordinates by impulses at the points of ties, and on θ2.

    Args:
        body: The body.
        coordinates: The coordinates of its motion.
        motion: The motion; only its pose counts.
        rows: The elements of the rows (`elements_with_rows`).
        sizes: The impulse along each axis of each tie, N s, inertial, then on θ2, N m s.
    """
    still = at_rest(motion)
    parts = np.split(sizes, np.cumsum([_count(element) for element in rows])[:-1])
    loads = [_load(body, still, element, part) for element, part in zip(rows, parts, strict=True)]
    # An impulse does to velocities at rest what the same force does to accelerations: gyroscopic
    # and centripetal terms have no time to act.
    jump, _ = coordinates.dynamics(body, still, _sum(loads))
    return jump


def elements_with_rows(elements: Iterable[Any]) -> list[Any]:
    """Return the elements that have rows in `Surfaces`: those that slide, then one that holds."""
    elements = list(elements)
    return [tie for tie in elements if tie.slides] + [stop for stop in elements if stop.holds]


def total_wrench(motion: Motion, pairs: list[Pair]) -> Wrench:
    """Return the sum of the wrenches of elements."""
    return _sum([element.wrench(motion, states) for element, states in pairs])


def _sum(wrenches: list[Wrench]) -> Wrench:
    force, couple, contact_force = ZERO, ZERO, ZERO
    for wrench in wrenches:
        force, couple = force + wrench.force, couple + wrench.couple
        contact_force = contact_force + wrench.contact_force
    return Wrench(force, couple, contact_force)


def _count(element: Any) -> int:
    """Return the number of rows of an element."""
    return 3 if element.slides else 1


def _load(body: Body, still: Motion, element: Any, force: Array) -> Wrench:
    """Return the wrench of a force at the point of a tie, or of a couple on θ2, shape (1,)."""
    if element.slides:
        return point.force_at(still, element.place(body), force)
    return couple_on_body(force[0] * pitch.direction(still))


def _held(element: Any) -> Array:
    """Return which axes of a tie are held, or whether the body rests against a stop."""
    held: Array = element.held if element.slides else np.array([element.mode[0] + element.mode[1]])
    return held


def _rates(
    body: Body, coordinates: Coordinates, motion: Motion, loads: Wrench, rows: list[Any]
) -> Array:
    """Return the rates ṡ = F' + κF of all axes of all ties under some loads, and θ̈2."""
    rates, Lambda_ = coordinates.dynamics(body, motion, loads)
    # Λ is the whole force at the contact point, also what holds it there.
    V_rate = (loads.force + Lambda_) / body.mass
    row_rates = []
    for element in rows:
        if element.slides:
            p = element.place(body)
            a = point.acceleration(motion, p, rates[OMEGA], V_rate)
            row_rates.append(element.surface_rate(motion, a))
        else:
            row_rates.append(np.array([pitch.acceleration(motion, rates[OMEGA])]))
    return np.concatenate(row_rates)
