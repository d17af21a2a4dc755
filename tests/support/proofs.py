"""Proofs as plain data: those of systems, and small ones that are written by hand."""

from dataclasses import replace
from fractions import Fraction
from functools import partial
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from rbstab.analysis.rest_state import RestState, rest_state_at
from rbstab.config.build import problem_of, system_of
from rbstab.config.schema import Config
from rbstab.experiment.stored_proof.proof import Proof
from rbstab.mechanics.numbers import Array
from rbstab.proof.enclosures.tied import bounds_of
from rbstab.proof.entries import ProvedState
from rbstab.proof.exact.expr import Expr, expr, variable
from rbstab.proof.limits import MOST
from rbstab.proof.model import Energy, ExactSystem, energy_of
from rbstab.proof.record import energy_record
from rbstab.proof.regions.regions import Regions
from rbstab.proof.rest_points import RestStates
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


def energy_of_config(config: Config) -> Energy:
    """Return the exact energy of a body, by the numbers of its config."""
    return energy_of(problem_of(config).system, partial(system_of, config))


_BODIES: WeakKeyDictionary[RestStates, Body] = WeakKeyDictionary()


def rest_states(
    system: System,
    exact_system: ExactSystem | None = None,
    *,
    proof: bool = True,
    seed: int = 0,
    box_limit: int = MOST,
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
        body = _BODIES[rest]
        wide = body.wide(rest, limit)
    if wide is not None:
        _BODIES[wide] = body
    return wide


def regions_of(rest: RestStates) -> Regions:
    """Return c* and the regions of the minima in a range."""
    with np.errstate(all="ignore"):
        return _BODIES[rest].regions(rest)


def rest_state_of(rest: RestStates, point: ProvedState) -> RestState:
    """Return one of the rest states in a list, with its remaining gradient."""
    body = _BODIES[rest]
    return rest_state_at(body.at_rest, body.configuration(np.array(point.orientation)))


def slopes_of(rest: RestStates, Theta: Array) -> Array:
    """Return ∇U at one point of shape (3,), J/rad, in doubles."""
    return _BODIES[rest].bounded.at(np.asarray(Theta)[:, np.newaxis])[1][:, 0]


def stored_energies(proof: Proof, Theta: Array) -> Array:
    """Return U of a stored proof at points of shape (m, 3), J, in doubles."""
    assert proof.reduced_energy is not None
    return bounds_of(proof.reduced_energy.energy).at(np.asarray(Theta).T)[0]


def _squared_distance(centre: tuple[float, float, float]) -> Expr:
    apart = (variable(k) - expr(Fraction(x)) for k, x in enumerate(centre))
    return sum((x * x for x in apart), expr(0)).scaled(Fraction(1, 2))


def parabola(centre: tuple[float, float, float], bound: float) -> PROOF:
    """Return a proof for U = ½ |Θ - centre|², J, with a certified region up to a bound."""
    box = [[x - 1e-9 for x in centre], [x + 1e-9 for x in centre]]
    return {
        "reduced_energy": energy_record(Energy(_squared_distance(centre))),
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
