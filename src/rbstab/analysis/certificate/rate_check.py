"""The check that v' is the derivative of v along the motion."""

from typing import Any

import numpy as np

from rbstab.analysis.certificate.evidence import (
    EPSILON,
    Evidence,
    Finding,
    confirmed,
    repeated,
)
from rbstab.analysis.certificate.verdict import Check, Verdict
from rbstab.analysis.exact import Ball, ball, exact_powers, in_balls
from rbstab.mechanics.derivatives import derivative_along
from rbstab.mechanics.numbers import Array, Number

DERIVATIVE_TOLERANCE = 1e-9
"""The allowed difference of v' and ∇v·f, relative to the sum of the absolute powers."""

MAX_DERIVATIVES = 51
"""Number of evenly spaced samples at which ∇v·f is evaluated; more would cost more than the run."""

NEGLIGIBLE = 1e-60
"""A power that is zero in exact arithmetic, relative to the terms that it is the sum of."""

AT_REST = 1e-28
"""Relative to the scale of a run: the energy of a state that is at rest up to its round-off.
Energies are squares of displacements and velocities, which are accurate to 1e-16; with a margin."""


def rate(run: Evidence) -> Check:
    """Check that v' equals ∇v·f, computed by a complex step along f without the dissipations."""
    last = len(run.times) - 1
    rows = np.unique(np.linspace(0, last, min(last + 1, MAX_DERIVATIVES)).round().astype(int))
    pairs = np.array([_rate_error(run, row) for row in rows])
    noise = _noise_of_powers(run, pairs[:, 1])
    errors = np.divide(
        pairs[:, 0], pairs[:, 1] + noise, out=np.zeros(len(rows)), where=pairs[:, 0] != 0
    )
    worst = int(errors.argmax())
    value, time = float(errors[worst]), float(run.times[rows[worst]])
    verdict = Verdict.CONSISTENT
    # NaN is doubtful, too; it is sorted to the front.
    order = np.nan_to_num(-errors, nan=-np.inf).argsort(kind="stable")
    doubtful = rows[order][~(errors[order] <= DERIVATIVE_TOLERANCE)]
    if len(doubtful):
        verdict, value, row = repeated(lambda row: _exact_rate(run, row, noise), doubtful)
        time = float(run.times[row])
    quantity = "max |∇v·f - v'| / power"
    return Check("derivative", verdict, value, DERIVATIVE_TOLERANCE, time, quantity)


def _noise_of_powers(run: Evidence, powers: Array) -> float:
    """Return the power, W, below which the powers of a run are round-off of its states."""
    span = float(run.times[-1] - run.times[0])
    # The powers of a motion that has come to rest have no meaning: they are far below those before,
    # and its energies are `AT_REST`.
    at_rest = AT_REST * run.scale / span if span > 0 else 0.0
    largest = float(np.nan_to_num(powers).max())
    # It is divided by `DERIVATIVE_TOLERANCE`, so that it can be added to a power.
    return (EPSILON * largest + at_rest) / DERIVATIVE_TOLERANCE


def _rate_error(run: Evidence, row: int) -> tuple[float, float]:
    """Return |∇v·f - v'| and the sum of the absolute powers at one sample, W."""
    system, y, rate = run.systems[row], run.states[row], float(run.rate[row])
    t = float(run.times[row])
    parts = derivative_along(lambda z: system.observe(z, t).energy, y, system.rates(y, t))
    seen = system.observe(y, t)
    contact = 0.0 if run.has_potential else float(seen.motion.F @ seen.contact_force)
    return _compared(parts.tolist(), contact, rate)


def _compared(by_part: list[Number], contact: Number, rate: Number) -> tuple[Any, Any]:
    """Return |∇v·f - v'| and the sum of the absolute powers, of floats or of balls."""
    return abs(sum(by_part) - contact - rate), sum(map(abs, by_part)) + abs(rate)


def _exact_rate(run: Evidence, row: int, noise: float) -> Finding:
    """Compare v' with ∇v·f at one sample in exact arithmetic."""
    errors = in_balls(lambda: _exact_rate_errors(run, row, noise))
    if errors is None:
        return Finding(Verdict.UNKNOWN, np.nan, row)
    of_equations, of_stored = errors
    if of_equations > DERIVATIVE_TOLERANCE:
        return Finding(Verdict.VIOLATED, float(of_equations), row)
    if of_equations <= DERIVATIVE_TOLERANCE and of_stored <= DERIVATIVE_TOLERANCE:
        return Finding(Verdict.CONSISTENT, float(of_stored), row)
    # If the equations hold, but the stored v' has lost its digits, the sample is not decided.
    return Finding(confirmed(_is_not_of_its_state(run, row, noise)), float(of_stored), row)


def _is_not_of_its_state(run: Evidence, row: int, noise: float) -> bool:
    """Return whether the stored v' differs from that of the stored state."""
    seen = run.systems[row].observe(run.states[row], float(run.times[row]))
    powers = np.concatenate([seen.supplied, -seen.dissipation])
    error = abs(float(run.rate[row]) - float(powers.sum()))
    return error > DERIVATIVE_TOLERANCE * (float(np.abs(powers).sum()) + noise)


def _exact_rate_errors(run: Evidence, row: int, noise: float) -> tuple[Ball, Ball]:
    """Return |∇v·f - v'| / power as balls, with the v' of the equations and with the stored one."""
    powers = exact_powers(run.systems[row], run.states[row], float(run.times[row]))
    contact = ball(0.0) if run.has_potential else powers.contact
    of_equations, power = _compared(powers.by_part, contact, powers.rate)
    of_stored, _ = _compared(powers.by_part, contact, float(run.rate[row]))
    # Without dissipation all powers are zero, and their balls contain zero.
    smallest = ball(NEGLIGIBLE * powers.terms / DERIVATIVE_TOLERANCE)
    power = power.max(smallest) + ball(noise)
    return of_equations / power, of_stored / power
