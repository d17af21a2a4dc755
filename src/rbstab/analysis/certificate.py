"""The certificate of a run: checks of the Lyapunov argument along its trajectory.

A failed check shows an error in the equations, the gains or the integration. A passed check is an
observation on this run only; proofs for all motions are in `rbstab.analysis.proof`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

import numpy as np

from rbstab.mechanics.derivatives import derivative_along
from rbstab.mechanics.numbers import Array
from rbstab.systems.system import System

MAX_AUDIT_BOUND = 1e-2
"""Relative to v(0): v is meaningless on a run with a larger residual."""

AUDIT_PER_TOLERANCE = 1e4
"""The allowed relative residual of a run, divided by the relative tolerance of a step."""

ROUND_OFF = 1e-12
"""The round-off of a sum, relative to v(0) or to the largest power."""

DERIVATIVE_TOLERANCE = 1e-9
"""The allowed difference of v' and ∇v·f, relative to the sum of the absolute powers."""

MAX_DERIVATIVES = 51
"""Number of evenly spaced samples at which ∇v·f is evaluated; more would cost more than the run."""


class Verdict(StrEnum):
    """The verdict on a check, or on a run."""

    CERTIFIED = "certified"
    """Proved: the run converges to its rest state."""

    CONSISTENT = "consistent"
    """Holds on this run, but is not proved for all motions."""

    VIOLATED = "violated"
    """Does not hold on this run."""

    UNKNOWN = "unknown"
    """Not decided: there is no proof, or the proof leaves it open."""


class Check(NamedTuple):
    """One line of a certificate.

    `value` is compared with `bound`; `quantity` is a description of both. `time`, s, is the time at
    which the value occurs, or NaN if the value has no time.
    """

    name: str
    verdict: Verdict
    value: float
    bound: float
    time: float
    quantity: str


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
        scale: The energy by which errors are divided, J.
        has_potential: Whether the contact force is the gradient of an energy; if not, v - ε
            replaces v.
        audit_bound: The largest allowed |residual| / scale.
    """

    times: Array
    states: Array
    systems: Sequence[System]
    value: Array
    rate: Array
    dissipation: Array
    residual: Array
    scale: float
    has_potential: bool
    audit_bound: float


def audit_bound(tolerance: float) -> float:
    """Return the allowed residual / v(0) for a run with this relative tolerance of its steps."""
    return min(MAX_AUDIT_BOUND, AUDIT_PER_TOLERANCE * tolerance)


def checks_of(run: Evidence) -> list[Check]:
    """Return the checks that need only the run, not a proof."""
    return [_audit(run), _monotone(run), _damping(run), _positive(run), _rate(run)]


def overall(checks: Sequence[Check], *, proved: bool) -> Verdict:
    """Return the verdict of a run: the worst verdict of its checks; `CERTIFIED` only with a proof.

    Args:
        checks: The checks of the run.
        proved: Whether the run starts in a region of proved convergence.
    """
    if any(check.verdict is Verdict.VIOLATED for check in checks):
        return Verdict.VIOLATED
    return Verdict.CERTIFIED if proved else Verdict.CONSISTENT


def _verdict(holds: bool) -> Verdict:
    return Verdict.CONSISTENT if holds else Verdict.VIOLATED


def _audit(run: Evidence) -> Check:
    """Check that |v(t) - v(0) - ∫v' dt| is small."""
    size = np.abs(run.residual) / run.scale
    worst = int(size.argmax())
    value, bound = float(size[worst]), run.audit_bound
    time = float(run.times[worst])
    return Check("audit", _verdict(value <= bound), value, bound, time, "max |r| / v(0)")


def _monotone(run: Evidence) -> Check:
    """Check that v never rises from sample to sample by more than its residual allows."""
    rise = np.append(np.diff(run.value), -np.inf) / run.scale
    worst = int(rise.argmax())
    bound = 2.0 * float(np.abs(run.residual).max()) / run.scale + ROUND_OFF
    value = max(float(rise[worst]), 0.0)
    time = float(run.times[worst]) if value > 0 else np.nan
    quantity = "largest rise of v between samples / v(0)"
    return Check("decrease", _verdict(value <= bound), value, bound, time, quantity)


def _damping(run: Evidence) -> Check:
    """Check that every damping matrix is positive definite, and that no part adds energy.

    The second test does not use the declarations of gains. So it also finds an element that adds
    energy to the motion but declares no dissipating gain.
    """
    system = run.systems[0]
    # Ignore the non-finite values at the end of a diverged run.
    dissipation = np.where(np.isfinite(run.dissipation), run.dissipation, 0.0)
    least = dissipation.min(axis=1)
    worst = int(least.argmin())
    if least[worst] < -ROUND_OFF * float(np.abs(dissipation).max()):
        part = system.parts[int(dissipation[worst].argmin())]
        value, time = float(least[worst]), float(run.times[worst])
        quantity = f"power dissipated by {part}, W"
        return Check("damping", Verdict.VIOLATED, value, 0.0, time, quantity)
    matrices = [
        getattr(element, gain.name)
        for element in system.elements
        for gain in element.gains
        if gain.dissipates
    ]
    smallest = [float(np.linalg.eigvalsh(0.5 * (L + L.T))[0]) for L in matrices]
    value = min(smallest, default=np.inf)
    quantity = "smallest eigenvalue of the damping matrices"
    return Check("damping", _verdict(value > 0), value, 0.0, np.nan, quantity)


def _positive(run: Evidence) -> Check:
    """Check that v is nowhere below its value at rest."""
    worst = int(run.value.argmin())
    value, bound = float(run.value[worst]) / run.scale, -ROUND_OFF
    time = float(run.times[worst])
    if not run.has_potential:
        # v - ε has no lower bound.
        return Check("positive", Verdict.CONSISTENT, value, -np.inf, time, "min v / v(0)")
    return Check("positive", _verdict(value >= bound), value, bound, time, "min v / v(0)")


def _rate(run: Evidence) -> Check:
    """Check that v' equals ∇v·f, computed by a complex step along f without the dissipations."""
    last = len(run.times) - 1
    rows = np.unique(np.linspace(0, last, min(last + 1, MAX_DERIVATIVES)).round().astype(int))
    errors = np.array([_rate_error(run, row) for row in rows])
    worst = int(errors.argmax())
    value, bound = float(errors[worst]), DERIVATIVE_TOLERANCE
    time, quantity = float(run.times[rows[worst]]), "max |∇v·f - v'| / power"
    return Check("derivative", _verdict(value <= bound), value, bound, time, quantity)


def _rate_error(run: Evidence, row: int) -> float:
    system, y, rate = run.systems[row], run.states[row], float(run.rate[row])
    parts = derivative_along(lambda z: system.observe(z).energy, y, system.rates(y))
    change = float(parts.sum())
    if not run.has_potential:
        observation = system.observe(y)
        change -= float(observation.motion.F @ observation.contact_force)
    power = float(np.abs(parts).sum()) + abs(rate)
    return abs(change - rate) / power if power != 0 else 0.0
