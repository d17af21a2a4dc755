"""Code of users whose motions can be enclosed: it runs with expressions, as our own equations do.

Its numbers are what their doubles mean, so motions follow the formulas of the rest states.
"""

from dataclasses import replace
from itertools import count, islice
from typing import Any

import numpy as np

from rbstab.analysis.configuration import Configurations, configurations
from rbstab.elements.element import Element
from rbstab.proof.exact.expr import expr, factored, numbers, variable, variables
from rbstab.proof.passive.passive import TIMED, in_proofs
from rbstab.systems.parameters import map_parameters
from rbstab.systems.system import System

GUARDS_SWITCH = "its event functions depend on its modes"


def why_not_recorded(system: System) -> str | None:
    """Return why an element of a user has no formulas at all states; None if all have."""
    at_rest = configurations(system)
    for element in system.elements:
        if not element.from_user:
            continue
        if not in_proofs(element):
            return f"{element.name} is code of a user that switches by its loads, or has many modes"
        try:
            with factored():
                why = _why_not(at_rest, element)
        except Exception as error:  # an element of a user may raise anything
            why = str(error) or type(error).__name__
        if why is not None:
            return f"{element.name} is code of a user that cannot be recorded: {why}"
    return None


def _why_not(at_rest: Configurations, element: Element) -> str | None:
    """Return on what a statement depends that no formula may; None if there is nothing."""
    places = count()
    exact = map_parameters(
        replace(at_rest.system, elements=(element,)), lambda _, values: numbers(values)
    )
    mine: Any = exact.elements[0]
    time, modes = next(places), list(islice(places, element.mode_count))
    if modes:
        mine = replace(mine, mode=variables(modes))
    motion = exact.motion(variables(islice(places, exact.coordinates.size)), variable(time))
    own = variables(islice(places, element.state_size))
    guards = mine.guards(motion, own) if modes else ()
    energies = mine.stored(motion, own), mine.dissipated(motion, own)
    stated = *np.concatenate(mine.wrench(motion, own)), *energies, *mine.rates(motion, own)
    by_guards = frozenset[int]().union(*(expr(g).variables for g in guards))
    if time in by_guards.union(*(expr(e).variables for e in stated)):
        return TIMED
    return None if by_guards.isdisjoint(modes) else GUARDS_SWITCH
