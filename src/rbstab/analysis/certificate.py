"""The certificate of a run: checks of the Lyapunov argument along its trajectory.

A failed check shows an error in the equations, the gains or the integration. A passed check is an
observation on this run only; proofs for all motions are in `rbstab.analysis.proof`.

Every bound is relative to the size of the terms that were added up. If a comparison of numbers that
follow from one state fails in double precision, it is repeated in exact arithmetic
(`rbstab.analysis.exact`). So round-off alone never gives the verdict `violated`.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

import numpy as np

from rbstab.analysis.exact import (
    Ball,
    ball,
    exact_dissipation,
    exact_energy,
    exact_powers,
    in_balls,
    is_positive_definite,
)
from rbstab.analysis.rest_state import RestState
from rbstab.mechanics.derivatives import derivative_along
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

DERIVATIVE_TOLERANCE = 1e-9
"""The allowed difference of v' and ∇v·f, relative to the sum of the absolute powers."""

MAX_DERIVATIVES = 51
"""Number of evenly spaced samples at which ∇v·f is evaluated; more would cost more than the run."""

NEGLIGIBLE = 1e-60
"""A power that is zero in exact arithmetic, relative to the terms that it is the sum of."""

MAX_REPEATED = 12
"""Number of samples that a check repeats in exact arithmetic; each takes some milliseconds."""

AT_REST = 1e-28
"""Relative to the scale of a run: the energy of a state that is at rest up to its round-off.
Energies are squares of displacements and velocities, which are accurate to 1e-16; with a margin."""


class Verdict(StrEnum):
    """The verdict on a check, or on a computed run."""

    CERTIFIED = "certified"
    """Proved of the exact motion. The verdict of a run is never this: it speaks of what was
    computed. In runs that were stored before this distinction, it says that convergence is proved.
    """

    CONSISTENT = "consistent"
    """Holds on this run, but is not proved for all motions."""

    DRIVEN = "driven"
    """Inputs supply power, so v may rise. That every rise is supplied holds on this run."""

    VIOLATED = "violated"
    """Does not hold on this run."""

    UNKNOWN = "unknown"
    """Not decided: no proof decides it, or the stored numbers are too inaccurate to tell."""


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
        scale: The energy by which errors are divided, J (`audit_scale`).
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


class _Finding(NamedTuple):
    """The verdict on one sample, and the number that it rests on."""

    verdict: Verdict
    value: float
    row: int


_SEVERITY = (Verdict.CONSISTENT, Verdict.DRIVEN, Verdict.UNKNOWN, Verdict.VIOLATED)


def audit_bound(tolerance: float) -> float:
    """Return the allowed residual / scale for a run with this relative tolerance of its steps."""
    return min(MAX_AUDIT_BOUND, AUDIT_PER_TOLERANCE * max(tolerance, EPSILON))


def checks_of(run: Evidence) -> list[Check]:
    """Return the checks that need only the run, not a proof."""
    if run.supply is None:
        return [_audit(run), _monotone(run), _damping(run), _positive(run), _rate(run)]
    driven = [_rise(run), _supplied(run, run.supply)]
    if len(run.supply.breakpoints):
        driven.append(_breakpoints(run.supply))
    return [_audit(run), *driven, _damping(run), _positive(run), _rate(run)]


def overall(checks: Sequence[Check]) -> Verdict:
    """Return the verdict of a computed run: the worst verdict of its checks.

    What is proved of the exact motion has no part in it: the run may have stopped early, or have
    been computed with a large tolerance.
    """
    return max((check.verdict for check in checks), key=_SEVERITY.index, default=_SEVERITY[0])


def _verdict(holds: bool) -> Verdict:
    return Verdict.CONSISTENT if holds else Verdict.VIOLATED


def _audit(run: Evidence) -> Check:
    """Check that |v(t) - v(0) - ∫v' dt| is small.

    This check measures the accuracy of the stored v. So exact arithmetic is no excuse for it.
    """
    size = np.abs(run.residual) / run.scale
    worst = int(size.argmax())
    value, bound, time = float(size[worst]), _residual_bound(run), float(run.times[worst])
    return Check("audit", _verdict(value <= bound), value, bound, time, "max |r| / v(0)")


def _residual_bound(run: Evidence) -> float:
    """Return the largest allowed |r| / scale: that of the run, or the round-off of v if larger."""
    return max(run.audit_bound, float(_rounding(run).max()) / run.scale)


def _rounding(run: Evidence) -> Array:
    """Return the round-off of v, a sum of energies minus that at rest, shape (n,), J."""
    at_rest = np.abs(run.energy.sum(axis=1) - run.value)
    return SUM_ERROR * (np.abs(run.energy).sum(axis=1) + at_rest)


def _monotone(run: Evidence) -> Check:
    """Check that v never rises from sample to sample by more than its residual allows.

    If the residual is above its own bound, a rise that only the residual allows is not decided.
    """
    rise = np.append(np.diff(run.value), -np.inf) / run.scale
    worst = int(rise.argmax())
    largest_change = float(np.abs(run.value - run.value[0]).max())
    rounding = max(ROUND_OFF, SUM_ERROR * largest_change / run.scale)
    bound = 2.0 * float(np.abs(run.residual).max()) / run.scale + rounding
    value = max(float(rise[worst]), 0.0)
    time = float(run.times[worst]) if value > 0 else np.nan
    quantity = "largest rise of v between samples / v(0)"
    verdict = _verdict(value <= bound)
    if verdict is Verdict.CONSISTENT and value > 2.0 * _residual_bound(run) + rounding:
        verdict = Verdict.UNKNOWN
    return Check("decrease", verdict, value, bound, time, quantity)


def _rise(run: Evidence) -> Check:
    """Say how much v rises between two samples, and where. It may: inputs supply power."""
    rise = np.append(np.diff(run.value), -np.inf) / run.scale
    worst = int(rise.argmax())
    value = max(float(rise[worst]), 0.0)
    time = float(run.times[worst]) if value > 0 else np.nan
    quantity = "largest rise of v between samples / v(0); inputs supply power"
    return Check("decrease", Verdict.DRIVEN, value, np.inf, time, quantity)


def _supplied(run: Evidence, supply: Supply) -> Check:
    """Check that v never rises by more than is supplied, as far as the residual allows."""
    excess = np.append(np.diff(run.value) - np.diff(supply.energy), -np.inf) / run.scale
    worst = int(excess.argmax())
    sizes = np.abs(run.value - run.value[0]) + np.abs(supply.energy)
    rounding = max(ROUND_OFF, SUM_ERROR * float(sizes.max()) / run.scale)
    bound = 2.0 * float(np.abs(run.residual).max()) / run.scale + rounding
    value = max(float(excess[worst]), 0.0)
    time = float(run.times[worst]) if value > 0 else np.nan
    quantity = "largest rise of v beyond what is supplied / v(0)"
    verdict = _verdict(value <= bound)
    if verdict is Verdict.CONSISTENT and value > 2.0 * _residual_bound(run) + rounding:
        verdict = Verdict.UNKNOWN
    return Check("supply", verdict, value, bound, time, quantity)


def _breakpoints(supply: Supply) -> Check:
    """Check that a step ended on every breakpoint: the audit does not see one that was missed."""
    missed = np.setdiff1d(supply.breakpoints, supply.reached)
    time = float(missed[0]) if len(missed) else np.nan
    quantity = f"missed breakpoints of {len(supply.breakpoints)}"
    return Check("breakpoints", _verdict(not len(missed)), float(len(missed)), 0.0, time, quantity)


def _damping(run: Evidence) -> Check:
    """Check that every damping matrix is positive definite, and that no part adds energy.

    The second test does not use the declarations of gains. So it also finds an element that adds
    energy to the motion but declares no dissipating gain.
    """
    adding = _adding_energy(run)
    if adding is not None:
        return adding
    matrices = [
        getattr(element, gain.name)
        for element in run.systems[0].elements
        for gain in element.gains
        if gain.dissipates
    ]
    smallest = [float(np.linalg.eigvalsh(0.5 * (L + L.T))[0]) for L in matrices]
    value = min(smallest, default=np.inf)
    quantity = "smallest eigenvalue of the damping matrices"
    verdict = _verdict(value > 0)
    if verdict is Verdict.VIOLATED and all(is_positive_definite(L) for L in matrices):
        verdict = Verdict.UNKNOWN
    return Check("damping", verdict, value, 0.0, np.nan, quantity)


def _adding_energy(run: Evidence) -> Check | None:
    """Return a check that is not consistent if a part adds energy, else None."""
    # Ignore the non-finite values at the end of a diverged run.
    dissipation = np.where(np.isfinite(run.dissipation), run.dissipation, 0.0)
    least, parts = dissipation.min(axis=1), dissipation.argmin(axis=1)
    rows = np.flatnonzero(least < -ROUND_OFF * float(np.abs(dissipation).max()))

    if not len(rows):
        return None

    def repeat(row: int) -> _Finding:
        system, y, part = run.systems[row], run.states[row], int(parts[row])
        t = float(run.times[row])
        power = in_balls(lambda: exact_dissipation(system, y, part, t))
        return _Finding(_confirmed(power is not None and power < 0), float(least[row]), row)

    verdict, value, row = _repeated(repeat, rows[least[rows].argsort(kind="stable")])
    quantity = f"power dissipated by {run.systems[row].parts[int(parts[row])]}, W"
    return Check("damping", verdict, value, 0.0, float(run.times[row]), quantity)


def _positive(run: Evidence) -> Check:
    """Check that v is nowhere below its value at rest."""
    worst = int(run.value.argmin())
    value, bound, verdict = float(run.value[worst]) / run.scale, -np.inf, Verdict.CONSISTENT
    # v - ε has no lower bound.
    if run.has_potential:
        rounding = np.maximum(ROUND_OFF, _rounding(run) / run.scale)
        bound = -float(rounding[worst])
        below = np.flatnonzero(~(run.value / run.scale >= -rounding))
        if len(below) and run.supply is not None:
            # Inputs may carry the motion from a lower rest state to a higher one.
            verdict = Verdict.DRIVEN
        elif len(below) and run.rest.is_at_rest and run.approached:
            at_rest = in_balls(run.exact_rest_energy)

            def repeat(row: int) -> _Finding:
                exact = in_balls(lambda: _exact_value(run, row, at_rest))
                is_below = exact is not None and exact < -ROUND_OFF and run.rest.is_accurate
                return _Finding(_confirmed(is_below), float(run.value[row]) / run.scale, row)

            rows = below[run.value[below].argsort(kind="stable")]
            verdict, value, worst = _repeated(repeat, rows)
        elif len(below) or not run.rest.is_at_rest:
            verdict = Verdict.UNKNOWN
    time = float(run.times[worst])
    return Check("positive", verdict, value, bound, time, "min v / v(0)")


def _exact_value(run: Evidence, row: int, energy_at_rest: Ball) -> Ball:
    """Return v / scale at a sample as a ball."""
    t = float(run.times[row])
    value = exact_energy(run.systems[row], run.states[row], t) - energy_at_rest
    return value / ball(run.scale)


def _rate(run: Evidence) -> Check:
    """Check that v' equals ∇v·f, computed by a complex step along f without the dissipations."""
    last = len(run.times) - 1
    rows = np.unique(np.linspace(0, last, min(last + 1, MAX_DERIVATIVES)).round().astype(int))
    found = np.array([_rate_error(run, row) for row in rows])
    noise = _noise_of_powers(run, found[:, 1])
    errors = np.divide(
        found[:, 0], found[:, 1] + noise, out=np.zeros(len(rows)), where=found[:, 0] != 0
    )
    worst = int(errors.argmax())
    value, time = float(errors[worst]), float(run.times[rows[worst]])
    verdict = Verdict.CONSISTENT
    # NaN is doubtful, too; it is sorted to the front.
    order = np.nan_to_num(-errors, nan=-np.inf).argsort(kind="stable")
    doubtful = rows[order][~(errors[order] <= DERIVATIVE_TOLERANCE)]
    if len(doubtful):
        verdict, value, row = _repeated(lambda row: _exact_rate(run, row, noise), doubtful)
        time = float(run.times[row])
    quantity = "max |∇v·f - v'| / power"
    return Check("derivative", verdict, value, DERIVATIVE_TOLERANCE, time, quantity)


def _noise_of_powers(run: Evidence, powers: Array) -> float:
    """Return the power, W, below which the powers of a run are round-off of its states.

    It is divided by `DERIVATIVE_TOLERANCE`, so that it can be added to a power. The powers of a
    motion that has come to rest have no meaning: they are far below those before, and its energies
    are `AT_REST`.
    """
    span = float(run.times[-1] - run.times[0])
    at_rest = AT_REST * run.scale / span if span > 0 else 0.0
    largest = float(np.nan_to_num(powers).max())
    return (EPSILON * largest + at_rest) / DERIVATIVE_TOLERANCE


def _rate_error(run: Evidence, row: int) -> tuple[float, float]:
    """Return |∇v·f - v'| and the sum of the absolute powers at one sample, W."""
    system, y, rate = run.systems[row], run.states[row], float(run.rate[row])
    t = float(run.times[row])
    parts = derivative_along(lambda z: system.observe(z, t).energy, y, system.rates(y, t))
    change = float(parts.sum())
    if not run.has_potential:
        observation = system.observe(y, t)
        change -= float(observation.motion.F @ observation.contact_force)
    power = float(np.abs(parts).sum()) + abs(rate)
    return abs(change - rate), power


def _exact_rate(run: Evidence, row: int, noise: float) -> _Finding:
    """Compare v' with ∇v·f at one sample in exact arithmetic.

    If the equations hold, but the stored v' has lost its digits, the sample is not decided.
    """
    errors = in_balls(lambda: _exact_rate_errors(run, row, noise))
    if errors is None:
        return _Finding(Verdict.UNKNOWN, np.nan, row)
    of_equations, of_stored = errors
    if of_equations > DERIVATIVE_TOLERANCE:
        return _Finding(Verdict.VIOLATED, float(of_equations), row)
    if of_equations <= DERIVATIVE_TOLERANCE and of_stored <= DERIVATIVE_TOLERANCE:
        return _Finding(Verdict.CONSISTENT, float(of_stored), row)
    return _Finding(_confirmed(_is_not_of_its_state(run, row, noise)), float(of_stored), row)


def _is_not_of_its_state(run: Evidence, row: int, noise: float) -> bool:
    """Return whether the stored v' differs from that of the stored state."""
    seen = run.systems[row].observe(run.states[row], float(run.times[row]))
    powers = np.concatenate([seen.supplied, -seen.dissipation])
    error = abs(float(run.rate[row]) - float(powers.sum()))
    return error > DERIVATIVE_TOLERANCE * (float(np.abs(powers).sum()) + noise)


def _exact_rate_errors(run: Evidence, row: int, noise: float) -> tuple[Ball, Ball]:
    """Return |∇v·f - v'| / power as balls, with the v' of the equations and with the stored one."""
    powers = exact_powers(run.systems[row], run.states[row], float(run.times[row]))
    change = sum(powers.by_part, ball(0.0))
    if not run.has_potential:
        change -= powers.contact
    power = sum((abs(part) for part in powers.by_part), abs(powers.rate))
    # Without dissipation all powers are zero, and their balls contain zero.
    smallest = ball(NEGLIGIBLE * powers.terms / DERIVATIVE_TOLERANCE)
    power = power.max(smallest) + ball(noise)
    return abs(change - powers.rate) / power, abs(change - float(run.rate[row])) / power


def _confirmed(violated: bool) -> Verdict:
    """Return the verdict on a comparison that failed in double precision."""
    return Verdict.VIOLATED if violated else Verdict.UNKNOWN


def _repeated(repeat: Callable[[int], _Finding], rows: Array) -> _Finding:
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
    return max(findings, key=lambda found: (_SEVERITY.index(found.verdict), abs(found.value)))
