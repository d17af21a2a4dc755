"""The statements of an element of a user, as exact expressions of a motion.

Its code is called with expressions. So what is proved holds for the formulas that it states then.
Its numbers and those of its code are what their doubles mean.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import count, product
from typing import Any

import numpy as np

from rbstab.analysis.configuration import Configurations
from rbstab.elements.element import Element
from rbstab.mechanics import contact
from rbstab.mechanics.algebra import ZERO
from rbstab.mechanics.motion import Motion
from rbstab.mechanics.numbers import Array
from rbstab.proof.exact.expr import Atom, Expr, expr, numbers, variable, variables
from rbstab.proof.exact.rewriting import substituted
from rbstab.systems.parameters import map_parameters
from rbstab.systems.system import System

VELOCITIES = range(2000, 2006)
"""The numbers of the variables Ω and V; those of Θ, X and own states are their places in q."""

TIME = 2010

ENTRIES = 3000
"""The number of the first variable that stands for an entry of a motion."""

MODES = 4000
"""The number of the variable whose step is the first mode."""


PARTS = tuple(name for name in Motion._fields if name != "time")


class NotRecordedError(Exception):
    """The code of an element did not run with expressions."""


@dataclass(frozen=True, eq=False)
class Stated:
    """What an element states of one motion.

    Args:
        motion: The motion.
        guards: The event functions.
        wrench: The entries of the force, the couple and the contact force.
        stored: The stored energy.
        dissipated: The dissipated power.
        rates: The rates of the own states.
    """

    motion: Motion
    guards: tuple[Expr, ...]
    wrench: tuple[Expr, ...]
    stored: Expr
    dissipated: Expr
    rates: tuple[Expr, ...]

    @property
    def used(self) -> tuple[Expr, ...]:
        """All of it, without the event functions."""
        return (*self.wrench, self.stored, self.dissipated, *self.rates)


@dataclass(frozen=True, eq=False)
class Statements:
    """The statements of an element, with a step for each of its modes.

    Args:
        of_motion: They, as functions of q, Ω, V and the time.
        of_entries: They, where each entry of the motion and each own state is a variable.
        at_rest: The rates of the own states of a body at rest, as functions of q.
        of_rotation: The stored energy of a body at rest, where the entries of A are variables.
        still: A motion without turning, with any A, and its dissipated power; None for a held body.
        own: The numbers of the own states in q.
        modes: The steps that stand for the modes.
        held: Whether the contact point is held.
    """

    of_motion: Stated
    of_entries: Stated
    at_rest: tuple[Expr, ...]
    of_rotation: Expr
    still: tuple[Motion, Expr] | None
    own: range
    modes: tuple[Atom, ...]
    held: bool

    def on_all_sides(self, holds: Callable[..., bool], *of: Expr) -> bool:
        """Return whether something holds of expressions with all values of the modes.

        It is asked of steps first, which take both values.
        """
        return holds(*of) or (
            any(a in self.modes for e in of for a in e.all_atoms)
            and all(holds(*side) for side in sides(of, self.modes))
        )


def sides(of: Sequence[Expr], modes: Sequence[Atom]) -> Iterator[list[Expr]]:
    """Yield expressions with all values of those modes on which they depend."""
    atoms = set[Atom]().union(*(e.all_atoms for e in of))
    switching = [a for a in modes if a in atoms]
    for values in product((0, 1), repeat=len(switching)):
        given = dict(zip(switching, map(expr, values), strict=True))
        yield [substituted(e, given) for e in of]


def own_numbers(at_rest: Configurations, element: Element) -> range:
    """Return the numbers of the own states of an element in q."""
    begin = at_rest.pose_size
    for other in at_rest.system.elements:
        if other is element:
            break
        begin += other.state_size
    return range(begin, begin + element.state_size)


def statements_of(at_rest: Configurations, element: Element) -> Statements:
    """Return the statements of an element.

    Args:
        at_rest: The configurations of its system, in doubles.
        element: One of the elements of this system.

    Raises:
        NotRecordedError: Its code does not run with expressions.
    """
    try:
        return _statements(at_rest, element)
    except ZeroDivisionError as error:
        raise NotRecordedError("it divides by zero") from error
    except Exception as error:
        # An element of a user may raise anything.
        raise NotRecordedError(str(error) or type(error).__name__) from error


def _statements(at_rest: Configurations, element: Element) -> Statements:
    alone = replace(at_rest.system, elements=(element,))
    system = map_parameters(alone, lambda _, values: numbers(values))
    (mine,) = system.elements
    steps = [variable(MODES + k).step(0) for k in range(element.mode_count)]
    if steps:
        switched: Any = mine
        mine = replace(switched, mode=np.array(steps, dtype=object))
    entries, places = own_numbers(at_rest, element), count(ENTRIES)
    own, time = variables(entries), variable(TIME)
    motion = _motion(system, at_rest, variables(VELOCITIES), time)
    parts = {name: _opaque(getattr(motion, name), places) for name in PARTS}
    opaque = Motion(**parts, time=time)
    still = None
    if not at_rest.held:
        velocities = np.array([*ZERO, *variables(VELOCITIES[3:])], dtype=object)
        moved = _motion(system, at_rest, velocities, time)
        moved = _with_any_rotation(system, moved, places)
        still = moved, expr(mine.dissipated(moved, own))
    resting = _motion(system, at_rest, np.concatenate([ZERO, ZERO]), time)
    return Statements(
        _stated(mine, motion, own),
        _stated(mine, opaque, _opaque(own, places)),
        tuple(map(expr, mine.rates(resting, own))),
        expr(mine.stored(_with_any_rotation(system, resting, places), own)),
        still,
        entries,
        tuple(a for step in steps for a in step.atoms),
        at_rest.held,
    )


def _stated(element: Element, motion: Motion, own: Array) -> Stated:
    return Stated(
        motion,
        tuple(map(expr, element.guards(motion, own))),
        tuple(map(expr, np.concatenate(element.wrench(motion, own)))),
        expr(element.stored(motion, own)),
        expr(element.dissipated(motion, own)),
        tuple(map(expr, element.rates(motion, own))),
    )


def _motion(system: System, at_rest: Configurations, velocities: Array, time: Expr) -> Motion:
    Theta, X = variables(range(3)), variables(range(3, 6))
    Omega, V = velocities[:3], velocities[3:]
    parts = [Theta, Omega] if at_rest.held else [Theta, Omega, X, V]
    return system.motion(np.concatenate(parts), time)


def _with_any_rotation(system: System, motion: Motion, places: Iterator[int]) -> Motion:
    """Return a motion at rest in which A is any matrix."""
    A, body, anchor = _opaque(motion.A, places), system.body, system.anchor
    if system.coordinates.holds_contact:
        return motion._replace(A=A, X=contact.centre_position(body, A, ZERO, anchor))
    return motion._replace(A=A, E=contact.displacement(body, A, motion.X, anchor))


def _opaque(part: Array, places: Iterator[int]) -> Array:
    """Return variables in place of the entries; a number that is known stays what it is."""
    found = np.array(part, dtype=object)
    for index, place in zip(np.ndindex(found.shape), places, strict=False):
        if expr(found[index]).constant is None:
            found[index] = variable(place)
    return found
