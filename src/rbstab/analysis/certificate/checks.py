"""The checks of a run: v balances and never rises by itself, and no part adds energy."""

import numpy as np

from rbstab.analysis.certificate.evidence import (
    ROUND_OFF,
    SUM_ERROR,
    Evidence,
    Finding,
    confirmed,
    repeated,
    residual_bound,
    rounding_of,
)
from rbstab.analysis.certificate.rate_check import rate
from rbstab.analysis.certificate.verdict import Check, Verdict, verdict_of
from rbstab.analysis.exact import Ball, ball, exact_observation, in_balls
from rbstab.analysis.lyapunov import ENERGY_SCALE
from rbstab.mechanics.numbers import Array

EIGENVALUE_ERROR = 1e-15
"""Error of a computed eigenvalue, relative to the largest entry of its matrix."""


def checks_of(run: Evidence) -> list[Check]:
    """Return the checks that need only the run, not a proof."""
    if run.supplied is None:
        falls = [decrease(run)]
    else:
        falls = [rise(run), supplied(run, run.supplied), *breakpoints(run)]
    return [audit(run), *falls, damping(run), positive(run), rate(run)]


def audit(run: Evidence) -> Check:
    """Check that |v(t) - v(0) - ∫v' dt| is small.

    This check measures the accuracy of the stored v. So exact arithmetic is no excuse for it.
    """
    size = np.abs(run.residual) / run.scale
    worst = int(size.argmax())
    value, bound, time = float(size[worst]), residual_bound(run), float(run.times[worst])
    return Check(
        "audit", verdict_of(value <= bound), value, bound, time, f"max |r| / {ENERGY_SCALE}"
    )


def decrease(run: Evidence) -> Check:
    """Check that v never rises from sample to sample by more than its residual allows.

    If the residual is above its own bound, a rise that only the residual allows is not decided.
    """
    sizes = np.abs(run.value - run.value[0])
    quantity = f"largest rise of {_name(run)} between samples / {ENERGY_SCALE}"
    return _bounded_rise(run, "decrease", np.diff(run.value), sizes, quantity)


def rise(run: Evidence) -> Check:
    """Say how much v rises between two samples, and where. It may: elements supply power."""
    value, time = _largest(run, np.diff(run.value))
    quantity = (
        f"largest rise of {_name(run)} between samples / {ENERGY_SCALE}; elements supply power"
    )
    return Check("decrease", Verdict.DRIVEN, value, np.inf, time, quantity)


def supplied(run: Evidence, energy: Array) -> Check:
    """Check that v never rises by more than is supplied, as far as the residual allows."""
    rises = np.diff(run.value) - np.diff(energy)
    sizes = np.abs(run.value - run.value[0]) + np.abs(energy)
    quantity = f"largest rise of {_name(run)} beyond what is supplied / {ENERGY_SCALE}"
    return _bounded_rise(run, "supply", rises, sizes, quantity)


def _bounded_rise(run: Evidence, name: str, rises: Array, sizes: Array, quantity: str) -> Check:
    """Check that no rise from one sample to the next, J, is above what the residual allows."""
    value, time = _largest(run, rises)
    # The rises, shape (n - 1,), are differences of numbers of these sizes, shape (n,).
    rounding = max(ROUND_OFF, SUM_ERROR * float(sizes.max()) / run.scale)
    bound = 2.0 * float(np.abs(run.residual).max()) / run.scale + rounding
    verdict = verdict_of(value <= bound)
    if verdict is Verdict.CONSISTENT and value > 2.0 * residual_bound(run) + rounding:
        verdict = Verdict.UNKNOWN
    return Check(name, verdict, value, bound, time, quantity)


def _largest(run: Evidence, rises: Array) -> tuple[float, float]:
    """Return the largest rise / scale, 0 if there is none, and its time, s; NaN without one."""
    relative = np.append(rises, -np.inf) / run.scale
    worst = int(relative.argmax())
    value = max(float(relative[worst]), 0.0)
    return value, float(run.times[worst]) if value > 0 else np.nan


def breakpoints(run: Evidence) -> list[Check]:
    """Check that a step ended on every breakpoint: the audit does not see one that was missed."""
    missed = np.setdiff1d(run.breakpoints, run.reached)
    time, count = float(missed[0]) if len(missed) else np.nan, float(len(missed))
    quantity = f"missed breakpoints of {len(run.breakpoints)}"
    check = Check("breakpoints", verdict_of(not count), count, 0.0, time, quantity)
    return [check] if len(run.breakpoints) else []


def positive(run: Evidence) -> Check:
    """Check that v is nowhere below its value at rest."""
    worst = int(run.value.argmin())
    value, bound, verdict = float(run.value[worst]) / run.scale, -np.inf, Verdict.CONSISTENT
    name = "v" if run.has_potential else f"({_name(run)})"
    # v - ε has no lower bound.
    if run.has_potential:
        rounding = np.maximum(ROUND_OFF, rounding_of(run) / run.scale)
        bound = -float(rounding[worst])
        below = np.flatnonzero(~(run.value / run.scale >= -rounding))
        if len(below) and run.supplied is not None:
            # Inputs may carry the motion from a lower rest state to a higher one.
            verdict = Verdict.DRIVEN
        elif len(below) and run.rest.is_at_rest and run.approached:
            at_rest = in_balls(run.exact_rest_energy)

            def repeat(row: int) -> Finding:
                exact = in_balls(lambda: _exact_value(run, row, at_rest))
                is_below = exact is not None and exact < -ROUND_OFF and run.rest.is_accurate
                return Finding(confirmed(is_below), float(run.value[row]) / run.scale, row)

            rows = below[run.value[below].argsort(kind="stable")]
            verdict, value, worst = repeated(repeat, rows)
        elif len(below) or not run.rest.is_at_rest:
            verdict = Verdict.UNKNOWN
    time = float(run.times[worst])
    return Check("positive", verdict, value, bound, time, f"min {name} / {ENERGY_SCALE}")


def _name(run: Evidence) -> str:
    """Return the name of what is compared."""
    return "v" if run.has_potential else "v - ε"


def _exact_value(run: Evidence, row: int, energy_at_rest: Ball) -> Ball:
    """Return v / scale at a sample as a ball."""
    t = float(run.times[row])
    seen = exact_observation(run.systems[row], run.states[row], t)
    return sum(seen.energy.tolist(), -energy_at_rest) / ball(run.scale)


def damping(run: Evidence) -> Check:
    """Check that no damping matrix has a negative eigenvalue, and that no part adds energy.

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
    value = min(map(_smallest_eigenvalue, matrices), default=0.0)
    quantity = "smallest eigenvalue of the damping matrices"
    return Check("damping", verdict_of(value >= 0), value, 0.0, np.nan, quantity)


def _smallest_eigenvalue(L: Array) -> float:
    """Return the smallest eigenvalue of a damping matrix; one that is 0 to round-off is 0."""
    smallest = float(np.linalg.eigvalsh(0.5 * (L + L.T))[0])
    return 0.0 if abs(smallest) <= EIGENVALUE_ERROR * float(np.abs(L).max()) else smallest


def _adding_energy(run: Evidence) -> Check | None:
    """Return a check that is not consistent if a part adds energy, else None."""
    # Ignore the non-finite values at the end of a diverged run.
    dissipation = np.where(np.isfinite(run.dissipation), run.dissipation, 0.0)
    least, parts = dissipation.min(axis=1), dissipation.argmin(axis=1)
    rows = np.flatnonzero(least < -ROUND_OFF * float(np.abs(dissipation).max()))

    if not len(rows):
        return None

    def repeat(row: int) -> Finding:
        system, y, part = run.systems[row], run.states[row], int(parts[row])
        t = float(run.times[row])
        power = in_balls(lambda: exact_observation(system, y, t).dissipation[part])
        return Finding(confirmed(power is not None and power < 0), float(least[row]), row)

    verdict, value, row = repeated(repeat, rows[least[rows].argsort(kind="stable")])
    quantity = f"power dissipated by {run.systems[row].parts[int(parts[row])]}, W"
    return Check("damping", verdict, value, 0.0, float(run.times[row]), quantity)
