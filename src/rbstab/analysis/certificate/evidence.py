"""The data that a certificate is computed from, and their round-off."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rbstab.analysis.exact import Ball
from rbstab.analysis.rest_state import RestState
from rbstab.mechanics.numbers import Array
from rbstab.systems.system import System

MAX_AUDIT_BOUND = 1e-2
"""Relative to the scale of the run: v is meaningless on a run with a larger residual."""

AUDIT_PER_TOLERANCE = 1e4
"""The allowed relative residual of a run, divided by the relative tolerance of a step."""

EPSILON = float(np.finfo(float).eps)

ROUND_OFF = 1e-12
"""The allowed error of v and of powers, relative to the scale of a run or its largest power."""

SUM_ERROR = 16 * EPSILON
"""The round-off of a sum of energies, relative to the sum of their absolute values."""


class Supply(NamedTuple):
    """What the elements of a run supply, and the breakpoints of its inputs.

    Attributes:
        power: By part, shape (n, parts), W.
        energy: The sum of all, integrated together with the motion, shape (n,), J.
        breakpoints: All breakpoints up to the end of the run, s.
        reached: Those on which a step ended, s.
    """

    power: Array
    energy: Array
    breakpoints: Array
    reached: Array


@dataclass(frozen=True, eq=False)
class Evidence:
    """The data that a certificate is computed from: a run, sample by sample.

    Args:
        times: Shape (n,), s.
        states: The state vectors, shape (n, states), in the coordinates of `systems`.
        systems: The smooth system at each sample.
        value: v, shape (n,), J.
        rate: v', shape (n,), W.
        dissipation: The dissipated power by part, shape (n, parts), W.
        residual: v(t) - v(0) - ∫v' dt, shape (n,), J.
        energy: By part, shape (n, parts), J.
        rest: The state at which v is zero: a rest state, if one was found.
        approached: Whether the motion approaches `rest` and the energy rises away from it; if not,
            v may fall below zero.
        exact_rest_energy: Returns the energy of `rest` as a ball; call it by `in_balls`.
        scale: The energy by which errors are divided, J (`energy_scale`).
        has_potential: Whether the contact force is the gradient of an energy; if not, v - ε
            replaces v.
        audit_bound: The largest allowed |residual| / scale.
        supply: What inputs supply; None if there are none.
    """

    times: Array
    states: Array
    systems: Sequence[System]
    value: Array
    rate: Array
    dissipation: Array
    residual: Array
    energy: Array
    rest: RestState
    approached: bool
    exact_rest_energy: Callable[[], Ball]
    scale: float
    has_potential: bool
    audit_bound: float
    supply: Supply | None = None


def audit_bound(tolerance: float) -> float:
    """Return the allowed residual / scale for a run with this relative tolerance of its steps."""
    return min(MAX_AUDIT_BOUND, AUDIT_PER_TOLERANCE * max(tolerance, EPSILON))


def residual_bound(run: Evidence) -> float:
    """Return the largest allowed |r| / scale: that of the run, or the round-off of v if larger."""
    return max(run.audit_bound, float(rounding_of(run).max()) / run.scale)


def rounding_of(run: Evidence) -> Array:
    """Return the round-off of v, a sum of energies minus that at rest, shape (n,), J."""
    at_rest = np.abs(run.energy.sum(axis=1) - run.value)
    return SUM_ERROR * (np.abs(run.energy).sum(axis=1) + at_rest)
