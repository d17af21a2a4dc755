"""Code of users whose motions can be enclosed: it runs with expressions, as our own equations do.

Its numbers are what their doubles mean, so motions follow the formulas of the rest states.
"""

from rbstab.analysis.configuration import configurations
from rbstab.proof.passive.passive import TIMED, in_proofs
from rbstab.proof.passive.statements import TIME, NotRecordedError, statements_of
from rbstab.systems.system import System

GUARDS_SWITCH = "its event functions depend on its modes"


def why_not_recorded(system: System) -> str | None:
    """Return why an element of a user has no formulas at all states; None if all have."""
    at_rest = configurations(system)
    for element in at_rest.system.elements:
        if not element.from_user:
            continue
        if not in_proofs(element):
            return f"{element.name} is code of a user that switches by its loads, or has many modes"
        why = ""
        try:
            statements = statements_of(at_rest, element)
        except NotRecordedError as error:
            why = str(error)
        else:
            of = statements.of_motion
            if any(TIME in e.variables for e in (*of.used, *of.guards)):
                why = TIMED
            elif any(a in statements.modes for g in of.guards for a in g.all_atoms):
                why = GUARDS_SWITCH
        if why:
            return f"{element.name} is code of a user that cannot be recorded: {why}"
    return None
