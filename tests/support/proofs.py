"""Proofs as plain data: those of systems, and small ones that are written by hand."""

from dataclasses import replace
from fractions import Fraction
from functools import partial
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from rbstab.analysis.rest_state import rest_state_at
from rbstab.config.build import problem_of, system_of
from rbstab.proof.enclosures.tied import bounds_of
from rbstab.proof.exact.expr import expr, variable
from rbstab.proof.limits import MOST
from rbstab.proof.model import Energy, energy_of
from rbstab.proof.record import energy_record
from rbstab.proof.rest_points import RestStates
from rbstab.proof.rest_states import Body
from rbstab.systems.parameters import map_parameters

PROOF = dict[str, Any]


def body_of(system, exact_system=None):
    """Return a system with its exact energy; by default its doubles mean the numbers they show."""
    without = replace(system, elements=tuple(e for e in system.elements if not e.from_user))
    return Body(
        system, exact_system or (lambda kind: map_parameters(without, lambda _, x: kind(x)))
    )


def energy_of_config(config):
    """Return the exact energy of a body, by the numbers of its config."""
    return energy_of(problem_of(config).system, partial(system_of, config))


_BODIES: WeakKeyDictionary[RestStates, Body] = WeakKeyDictionary()


def rest_states(system, exact_system=None, *, proof=True, seed=0, box_limit=MOST):
    """Return the rest states of a system in the range of eq. 5, proved or looked for."""
    with np.errstate(all="ignore"):
        body = body_of(system, exact_system)
        rest = body.proved(box_limit) if proof else body.searched(seed)
    _BODIES[rest] = body
    return rest


def unwrapped_rest_states(rest, limit=None):
    """Return those for all real θ1 and θ3; None if nothing bounds these."""
    with np.errstate(all="ignore"):
        body = _BODIES[rest]
        wide = body.wide(rest, limit)
    if wide is not None:
        _BODIES[wide] = body
    return wide


def regions_of(rest):
    """Return c* and the regions of the minima in a range."""
    with np.errstate(all="ignore"):
        return _BODIES[rest].regions(rest)


def rest_state_of(rest, point):
    """Return one of the rest states in a list, with its remaining gradient."""
    body = _BODIES[rest]
    return rest_state_at(body.at_rest, body.configuration(np.array(point.orientation)))


def slopes_of(rest, Theta):
    """Return ∇U at one point of shape (3,), J/rad, in doubles."""
    return _BODIES[rest].bounded.at(np.asarray(Theta)[:, np.newaxis])[1][:, 0]


def stored_energies(proof, Theta):
    """Return U of a stored proof at points of shape (m, 3), J, in doubles."""
    assert proof.reduced_energy is not None
    return bounds_of(proof.reduced_energy.energy).at(np.asarray(Theta).T)[0]


def _squared_distance(centre):
    apart = (variable(k) - expr(Fraction(x)) for k, x in enumerate(centre))
    return sum((x * x for x in apart), expr(0)).scaled(Fraction(1, 2))


def parabola(centre, bound):
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
