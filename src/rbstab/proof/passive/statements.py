"""The statements of an element of a user, as exact expressions of a motion.

Its code is called with expressions. So what is proved holds for the formulas that it states then.
Its numbers and those of its code are what their doubles mean.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np

from rbstab.analysis.configuration import Configurations
from rbstab.elements.element import Element
from rbstab.mechanics.motion import Motion, motion_from_centre
from rbstab.proof.exact.atoms import Atom
from rbstab.proof.exact.expr import Expr, expr, numbers, variable, variables
from rbstab.proof.exact.rewriting import substituted
from rbstab.systems.parameters import map_parameters

VELOCITIES = range(2000, 2006)
"""The numbers of the variables Ω and V; those of Θ, X and own states are their places in q."""

TIME = 2010

ENTRIES = range(3000, 3021)
"""The numbers of the entries of any A and B, and of any X of a body that is held."""

MODES = 4000
"""The number of the variable whose step is the first mode."""


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
        of_any: They of a body that is not held, with any A and B.
        state_numbers: The numbers of the own states in q.
        modes: The steps that stand for the modes.
        held: Whether the contact point is held.
    """

    of_motion: Stated
    of_any: Stated
    state_numbers: range
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


def state_numbers_of(at_rest: Configurations, element: Element) -> range:
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
    (exact_element,) = system.elements
    steps = [variable(MODES + k).step(0) for k in range(element.mode_count)]
    if steps:
        switched: Any = exact_element
        exact_element = replace(switched, mode=np.array(steps, dtype=object))
    state_numbers = state_numbers_of(at_rest, element)
    Omega, V = np.split(variables(VELOCITIES), 2)
    Theta, A, B = variables(range(3)), *variables(ENTRIES[:18]).reshape(2, 3, 3)
    X = variables(ENTRIES[18:] if at_rest.held else range(3, 6))
    Z = np.concatenate([Theta, Omega, X, V])
    motion = system.motion(Z[:6] if at_rest.held else Z, variable(TIME))
    of_any = motion_from_centre(system.body, system.anchor, Z, (A, B))._replace(time=motion.time)
    return Statements(
        _stated(exact_element, motion, variables(state_numbers)),
        _stated(exact_element, of_any, variables(state_numbers)),
        state_numbers,
        tuple(a for step in steps for a in step.atoms),
        at_rest.held,
    )


def _stated(element: Element, motion: Motion, element_states: Any) -> Stated:
    return Stated(
        motion,
        tuple(map(expr, element.guards(motion, element_states))),
        tuple(map(expr, np.concatenate(element.wrench(motion, element_states)))),
        expr(element.stored(motion, element_states)),
        expr(element.dissipated(motion, element_states)),
        tuple(map(expr, element.rates(motion, element_states))),
    )
