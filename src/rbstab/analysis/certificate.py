"""Whether the Lyapunov argument holds along one run, line by line.

A line that fails is a fault: of the equations, of the gains, or of the integration. Lines that hold
are seen to hold on this run; what is proved of all motions is `rest_states` and `certified_region`.
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
"""Of v(0): with more than this unaccounted for, v says nothing about the run."""

AUDIT_PER_TOLERANCE = 1e4
"""How much larger than a step's relative tolerance the error of a whole run may be."""

ROUND_OFF = 1e-12
"""Of v(0): what sums of energies lose."""

DERIVATIVE_TOLERANCE = 1e-9
"""Of the largest power that is in the sum: the formula of v' and ∇v·f agree to round-off."""

MAX_DERIVATIVES = 51
"""Samples at which ∇v·f is taken, evenly spaced: more would cost more than the integration."""


class Verdict(StrEnum):
    """What is known of a line, or of a run."""

    CERTIFIED = "certified"
    """Proved: the run converges to its rest state."""

    CONSISTENT = "consistent"
    """Seen to hold on this run, not proved of all motions."""

    VIOLATED = "violated"
    """Seen not to hold."""

    UNKNOWN = "unknown"
    """Not asked: there is no proof here to read it from."""


class Check(NamedTuple):
    """One line of a certificate.

    value is what was found and bound what it is compared with, both as `quantity` says; time, s, is
    where the value was found (NaN where it belongs to no time).
    """

    name: str
    verdict: Verdict
    value: float
    bound: float
    time: float
    quantity: str


@dataclass(frozen=True, eq=False)
class Evidence:
    """What a certificate is made from: a run sample by sample.

    Args:
        times: Shape (n,), s.
        states: Shape (n, states), of `systems`.
        systems: The smooth system at each sample.
        value: v, shape (n,), J.
        rate: v', shape (n,), W.
        residual: v(t) - v(0) - ∫v' dt, shape (n,), J.
        scale: The energy that errors are measured by, J.
        has_potential: Whether the contact force is the gradient of an energy; if it is not, v - ε
            takes the place of v.
        audit_bound: How large |residual| may be, of the scale.
    """

    times: Array
    states: Array
    systems: Sequence[System]
    value: Array
    rate: Array
    residual: Array
    scale: float
    has_potential: bool
    audit_bound: float


def audit_bound(tolerance: float) -> float:
    """How large a residual may be, of v(0), for a run with a relative tolerance of its steps."""
    return min(MAX_AUDIT_BOUND, AUDIT_PER_TOLERANCE * tolerance)


def checks_of(run: Evidence) -> list[Check]:
    """Every line that is decided by the run alone."""
    return [_audit(run), _monotone(run), _damping(run), _positive(run), _rate(run)]


def overall(checks: Sequence[Check], *, proved: bool) -> Verdict:
    """The verdict of a run: its worst line, no better than `CONSISTENT` where nothing proves it.

    Args:
        checks: The lines.
        proved: Whether the run starts inside a region that is proved to converge.
    """
    if any(check.verdict is Verdict.VIOLATED for check in checks):
        return Verdict.VIOLATED
    return Verdict.CERTIFIED if proved else Verdict.CONSISTENT


def _judged(holds: bool) -> Verdict:
    return Verdict.CONSISTENT if holds else Verdict.VIOLATED


def _audit(run: Evidence) -> Check:
    """|v(t) - v(0) - ∫v' dt| is small."""
    size = np.abs(run.residual) / run.scale
    worst = int(size.argmax())
    value, bound = float(size[worst]), run.audit_bound
    time = float(run.times[worst])
    return Check("audit", _judged(value <= bound), value, bound, time, "max |r| / v(0)")


def _monotone(run: Evidence) -> Check:
    """V never rises from sample to sample by more than the audit leaves open."""
    rise = np.append(np.diff(run.value), -np.inf) / run.scale
    worst = int(rise.argmax())
    bound = 2.0 * float(np.abs(run.residual).max()) / run.scale + ROUND_OFF
    value = max(float(rise[worst]), 0.0)
    time = float(run.times[worst]) if value > 0 else np.nan
    quantity = "largest rise of v between samples / v(0)"
    return Check("decrease", _judged(value <= bound), value, bound, time, quantity)


def _damping(run: Evidence) -> Check:
    """Every dissipation matrix is positive definite."""
    system = run.systems[0]
    matrices = [getattr(e, name) for e in system.elements for name in e.damping]
    smallest = [float(np.linalg.eigvalsh(0.5 * (L + L.T))[0]) for L in matrices]
    value = min(smallest, default=np.inf)
    quantity = "smallest eigenvalue of the damping matrices"
    return Check("damping", _judged(value > 0), value, 0.0, np.nan, quantity)


def _positive(run: Evidence) -> Check:
    """V is nowhere below its value at rest."""
    worst = int(run.value.argmin())
    value, bound = float(run.value[worst]) / run.scale, -ROUND_OFF
    time = float(run.times[worst])
    if not run.has_potential:
        # v - ε is not bounded from below by anything.
        return Check("positive", Verdict.CONSISTENT, value, -np.inf, time, "min v / v(0)")
    return Check("positive", _judged(value >= bound), value, bound, time, "min v / v(0)")


def _rate(run: Evidence) -> Check:
    """V' is ∇v·f, by a complex step along the motion, which knows nothing of dissipation."""
    last = len(run.times) - 1
    rows = np.unique(np.linspace(0, last, min(last + 1, MAX_DERIVATIVES)).round().astype(int))
    apart = np.array([_rate_error(run, row) for row in rows])
    worst = int(apart.argmax())
    value, bound = float(apart[worst]), DERIVATIVE_TOLERANCE
    time, quantity = float(run.times[rows[worst]]), "max |∇v·f - v'| / power"
    return Check("derivative", _judged(value <= bound), value, bound, time, quantity)


def _rate_error(run: Evidence, row: int) -> float:
    system, y, rate = run.systems[row], run.states[row], float(run.rate[row])
    parts = derivative_along(lambda z: system.observe(z).energy, y, system.rates(y))
    change = float(parts.sum())
    if not run.has_potential:
        seen = system.observe(y)
        change -= float(seen.motion.F @ seen.contact_force)
    power = float(np.abs(parts).sum()) + abs(rate)
    return abs(change - rate) / power if power != 0 else 0.0
