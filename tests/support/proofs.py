"""Proofs as plain data: those of systems, and small ones that are written by hand."""

from dataclasses import replace
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from rbstab.analysis.proof.rest_states import RestStates
from rbstab.analysis.proof.searches.limits import BOX_LIMIT
from rbstab.analysis.proof_check.checker import check
from rbstab.analysis.proof_check.cover import Cover
from rbstab.analysis.proof_check.findings import Finding
from rbstab.experiment.proof import _regions_of
from rbstab.experiment.stored_proof.reduced import proof_record
from rbstab.mechanics.numbers import Array
from rbstab.proof.model import ExactSystem
from rbstab.proof.rest_states import Body
from rbstab.systems.parameters import map_parameters
from rbstab.systems.system import System

PROOF = dict[str, Any]


def body_of(system: System, exact_system: ExactSystem | None = None) -> Body:
    """Return a system with its exact energy; by default its doubles mean the numbers they show."""
    without = replace(system, elements=tuple(e for e in system.elements if not e.from_user))
    return Body(
        system, exact_system or (lambda kind: map_parameters(without, lambda _, x: kind(x)))
    )


_BODIES: WeakKeyDictionary[RestStates, Body] = WeakKeyDictionary()


def rest_states(
    system: System,
    exact_system: ExactSystem | None = None,
    *,
    proof: bool = True,
    seed: int = 0,
    box_limit: int = BOX_LIMIT,
) -> RestStates:
    """Return the rest states of a system in the range of eq. 5, proved or looked for."""
    with np.errstate(all="ignore"):
        body = body_of(system, exact_system)
        found = body.proved(box_limit) if proof else body.searched(seed)
    _BODIES[found] = body
    return found


def unwrapped_rest_states(rest: RestStates, limit: int | None = None) -> RestStates | None:
    """Return those for all real θ1 and θ3; None if nothing bounds these."""
    with np.errstate(all="ignore"):
        return _BODIES[rest].wide(rest, limit)


def proof_of(system: System, *, wide: bool = False, box_limit: int = BOX_LIMIT) -> PROOF:
    """Return the proof of a system.

    Args:
        system: The system.
        wide: Whether to add the rest states for all θ1 and θ3.
        box_limit: The number of boxes at which the proof stops.
    """
    with np.errstate(all="ignore"):
        rest = rest_states(system, box_limit=box_limit)
        unwrapped = unwrapped_rest_states(rest) if wide else None
        record = proof_record(
            "id", _regions_of(rest), None if unwrapped is None else _regions_of(unwrapped), 0.0
        )
    return record.model_dump(mode="json")


_FINDINGS: dict[str, list[Finding]] = {}


def findings_of(proof: PROOF) -> list[Finding]:
    """Return what `check` finds of a proof; equal proofs are checked once."""
    # Python prints all digits of a float.
    content = repr(proof)
    if content not in _FINDINGS:
        _FINDINGS[content] = check(proof)
    return list(_FINDINGS[content])


def parabola(centre: tuple[float, float, float], bound: float) -> PROOF:
    """Return a proof for U = ½ |Θ - centre|², J, with a certified region up to a bound."""
    box = [[x - 1e-9 for x in centre], [x + 1e-9 for x in centre]]
    return {
        "reduced_energy": {
            "quadratic": np.eye(3).tolist(),
            "linear": [-x for x in centre],
            "coefficients": [[[0.5 * sum(x * x for x in centre)]]],
        },
        "proved": True,
        "unique": True,
        "undecided": [],
        "states": [
            {
                "orientation": list(centre),
                "index": 0,
                "index_proved": True,
                "proved": True,
                "enclosure": box,
            }
        ],
        "region": {"lower_bound": bound - 1e-9, "energy_bound": bound},
        "regions": [],
        "unwrapped": None,
    }


def leaves(found: Cover) -> list[tuple[str, Array]]:
    """Return the settled boxes of a cover with their reasons, from its tree alone."""
    tree, listed = iter(found.tree), []

    def walk(box: Array) -> None:
        entry = next(tree)
        if not entry.isdigit():
            listed.append((entry, box))
            return
        lower, upper, axis = box.copy(), box.copy(), int(entry) - 1
        lower[axis, 1] = upper[axis, 0] = box[axis, 0] / 2 + box[axis, 1] / 2
        walk(lower)
        walk(upper)

    walk(np.array(found.box))
    assert list(tree) == []
    return listed
