"""The evidence of some states, as that of a run without integration errors, and its checks."""

from dataclasses import replace

import numpy as np

from rbstab.analysis.certificate import checks
from rbstab.analysis.certificate.evidence import Evidence
from rbstab.analysis.certificate.verdict import Verdict
from rbstab.analysis.exact import exact_rest_energy
from rbstab.analysis.lyapunov import energy_scale
from rbstab.analysis.rest_state import nearest_rest_state
from rbstab.analysis.settling import value_round_off
from rbstab.mechanics.body import Body
from rbstab.mechanics.motion import motion_from_centre
from support.rest import HEAVY, paper_system
from support.systems import random_Z

CONSISTENT, UNKNOWN, VIOLATED = Verdict.CONSISTENT, Verdict.UNKNOWN, Verdict.VIOLATED


def evidence(system, states, **changes):
    """Return the evidence of some states, as if they were a run without integration errors.

    v falls from state to state, so `decrease` and `audit` hold.
    """
    rest = nearest_rest_state(system)
    observed = [system.observe(y) for y in states]
    energy = np.array([o.energy for o in observed])
    value = energy.sum(axis=1) - rest.energy
    order = np.argsort(-value)
    dissipation = np.array([o.dissipation for o in observed])[order]
    given = {
        "times": np.arange(len(states), dtype=float),
        "states": np.array(states)[order],
        "systems": (system,) * len(states),
        "value": value[order],
        "rate": -dissipation.sum(axis=1),
        "dissipation": dissipation,
        "residual": np.zeros(len(states)),
        "energy": energy[order],
        "rest": rest,
        "approached": True,
        "exact_rest_energy": lambda: exact_rest_energy(system, rest),
        "scale": float(energy_scale(value, round_off(system, states[order[0]]))),
        "has_potential": True,
        "audit_bound": 1e-8,
    }
    return Evidence(**(given | changes))


def round_off(system, start):
    """Return the energy below which v is round-off, J."""
    return value_round_off(lambda y: system.observe(y).energy, np.asarray(start))


def check(run, name):
    """Return the check of a run with this name."""
    (match,) = [line for line in checks.checks_of(run) if line.check == name]
    return match


def state_of(system, Z):
    """Return the state of a system at Z, with own states of zero."""
    motion = motion_from_centre(system.body, system.anchor, Z)
    return system.start(motion, np.zeros(system.size - system.coordinates.size))


def states_of(system, count=5, scale=1.0, seed=3):
    """Return random states."""
    rng = np.random.default_rng(seed)
    return [state_of(system, scale * random_Z(rng)) for _ in range(count)]


def stretched(variant):
    """Return a paper system whose inertia is (1e13, 1, 1)."""
    system = paper_system(variant)
    return replace(system, body=Body(41.0, np.diag([1e13, 1.0, 1.0]), system.body.contact_point))


def settled(**changes):
    """Return the evidence of a heavy body close to its rest state."""
    system = paper_system("free", weight=HEAVY)
    rest = nearest_rest_state(system)
    y = system.start(rest.motion, np.zeros(0))
    start = y + 1e-3 * np.eye(12)[9]
    return evidence(system, [start, y], **changes)
