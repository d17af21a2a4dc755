"""The data that a certificate is computed from, and their round-off."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rbstab.analysis.approached_state import LyapunovZero
from rbstab.analysis.certificate.verdict import SEVERITY, Verdict
from rbstab.analysis.configuration import as_at_rest
from rbstab.analysis.exact import Ball, exact_rest_energy
from rbstab.analysis.lyapunov import energy_scale, has_no_potential
from rbstab.analysis.rest_state import RestState
from rbstab.analysis.rest_system import smooth_rest_system
from rbstab.integrate.problem import Problem, Trajectory
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

MAX_REPEATED = 12
"""Number of samples that a check repeats in exact arithmetic; each takes some milliseconds."""


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
        supplied: What elements supply, integrated with the motion, shape (n,), J; None without any.
        breakpoints: All breakpoints of the inputs up to the end of the run, s.
        reached: Those on which a step ended, s.
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
    supplied: Array | None = None
    breakpoints: Sequence[float] = ()
    reached: Array | Sequence[float] = ()


def evidence_of(
    problem: Problem, trajectory: Trajectory, arrays: dict[str, Array], zero: LyapunovZero
) -> Evidence:
    """Return the evidence of a run.

    Args:
        problem: The problem.
        trajectory: Its trajectory.
        arrays: The recorded quantities along it, by their names.
        zero: The state at which v is zero.
    """
    system, times, v = problem.system, trajectory.times, arrays["lyapunov"]
    supplied = trajectory.supplied_energy
    return Evidence(
        times=times,
        states=trajectory.states,
        systems=trajectory.systems,
        value=v,
        rate=arrays["lyapunov_rate"],
        dissipation=arrays["dissipation"],
        residual=arrays["energy_residual"],
        energy=arrays["energy"],
        rest=zero.rest,
        approached=zero.approached and as_at_rest(system) is system,
        exact_rest_energy=lambda: exact_rest_energy(smooth_rest_system(problem), zero.rest),
        scale=float(energy_scale(v, arrays["energy_round_off"], supplied)),
        has_potential=not has_no_potential(system),
        audit_bound=computed_audit_bound(problem),
        supplied=supplied,
        breakpoints=[t for t in problem.breakpoints() if t < times[-1]],
        reached=trajectory.breakpoints,
    )


def computed_audit_bound(problem: Problem) -> float:
    """Return the allowed error of a run, relative to the size of what is compared."""
    # Implicit steps are of first order: the tolerance has no effect on them.
    implicit = problem.switching is not None and problem.switching.step > 0
    return MAX_AUDIT_BOUND if implicit else audit_bound(problem.rtol)


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


class Finding(NamedTuple):
    """The verdict on one sample, and the number that it rests on."""

    verdict: Verdict
    value: float
    row: int


def confirmed(violated: bool) -> Verdict:
    """Return the verdict on a comparison that failed in double precision."""
    return Verdict.VIOLATED if violated else Verdict.UNKNOWN


def repeated(repeat: Callable[[int], Finding], rows: Array) -> Finding:
    """Repeat a check in exact arithmetic at samples where it failed, and return the worst finding.

    Args:
        repeat: Repeats the check at one sample.
        rows: The samples, worst first; the check is repeated at the first `MAX_REPEATED`.
    """
    findings = []
    for row in rows[:MAX_REPEATED].tolist():
        findings.append(repeat(row))
        if findings[-1].verdict is Verdict.VIOLATED:
            break
    return max(findings, key=lambda finding: (SEVERITY.index(finding.verdict), abs(finding.value)))
