"""One step of all motions from a set: P(z) + Qw with |z| <= 1 and |w| <= ω, and such a set later.

As in `motion_proof.step`, but p is a polynomial in τ = t/h and in z: one for each start. Φ and Ψ
belong to p at z = 0, and J is ∂f/∂y there. For each z, J̄ is the mean of ∂f/∂y between p and p + e.
Taylor models of ∂f/∂y on the whole set give a bound G on |J̄ - J|. Then, as there, |e| is below b on
the whole step and |w| at most W, as soon as

    W = ω + A b + hC (G b + |d|),    |ΦQ| W + |I - ΦΨ| b < b.

`docs/proofs.md` has the proof.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rbstab.analysis.motion_proof.dual import objects
from rbstab.analysis.motion_proof.linear_flow import (
    Frame,
    LinearBounds,
    LinearFlow,
    frame_of,
    linear_bounds,
    linear_flow,
)
from rbstab.analysis.motion_proof.rounding import all_moderate, rounded_up
from rbstab.analysis.motion_proof.sets.equations import Equations
from rbstab.analysis.motion_proof.sets.models import UNIT, Model, TooWide, evaluated
from rbstab.analysis.motion_proof.sets.monomials import Monomials, monomials_up_to
from rbstab.analysis.motion_proof.sets.motion_set import MotionSet
from rbstab.analysis.motion_proof.sets.series import Series
from rbstab.analysis.motion_proof.step import moved_frame
from rbstab.analysis.motion_proof.taylor import (
    Coefficients,
    DiscBounds,
    JacobianSeries,
    disc_bounds,
    jacobian_series,
    jacobian_slopes,
)
from rbstab.mechanics.numbers import Array

ORDER = 12
"""The highest power of τ in p."""

JACOBIAN_TERMS = 12
"""The number of terms of ∂f/∂y, at most ORDER + 1, and the degree of Φ and Ψ."""

JACOBIAN_DEGREE = 3
"""The highest degree in z of the models of ∂f/∂y."""

RATIO = 8.0
"""ρ: Cauchy's estimates hold for complex |τ| up to ρ. Longer steps with a smaller ρ would be fewer,
but |Φ| and |Ψ| would let the error grow faster."""

TOLERANCE = 1e-15
"""The size of the last terms of p in τ, relative to the scale of a state."""

MAX_LAST_TERM = 1e-6
"""The allowed norm of the last term of Φ, in scaled states."""

MARGIN = 1e-6
"""The least |e| for which a step is bounded, relative to the scale of a state."""

GROWTH = 2.0
"""The largest |e| for which a step is bounded, relative to that at its beginning."""

ATTEMPTS = 12
"""Attempts to find the bound b of one step."""


class SetStep(NamedTuple):
    """A proved step: its length, s, and the set at its end."""

    h: float
    end: MotionSet


def set_step(
    equations: Equations, start: MotionSet, scale: Array, longest: float
) -> SetStep | None:
    """Prove one step of all motions from a set.

    Args:
        equations: The equations.
        start: The set.
        scale: The size of each state, shape (n,); the choice has no effect on what is proved.
        longest: The largest step, s.

    Returns:
        The step; None if no bounds were found: a shorter step, or a smaller set, may succeed.
    """
    try:
        with np.errstate(all="ignore"):  # a number that is not finite fails every test below
            frame = frame_of(start.frame)
            if frame is None:
                return None
            h, p = _polynomial(equations, start, scale, longest)
            margin = rounded_up(GROWTH * start.error + MARGIN * scale)
            return _proved_step(_Step(equations, start.space, frame, scale, h, p, margin), start)
    except (TooWide, ZeroDivisionError):
        return None


def _polynomial(
    equations: Equations, start: MotionSet, scale: Array, longest: float
) -> tuple[float, Array]:
    """Return the length of a step and p, shape (n, monomials, ORDER + 1)."""
    p = Series(equations.rates, start.space, ORDER).of(start.polynomial, longest)
    factor = 1.0
    for k in (ORDER - 1, ORDER):
        size = float((np.abs(p[:, :, k]).sum(axis=1) / scale).max())
        if size > 0:
            factor = min(factor, (TOLERANCE / size) ** (1.0 / k))
    h = longest * factor
    # p is what these products are; p at τ = 0 stays as it is.
    return h, p * (h / longest) ** np.arange(ORDER + 1)


@dataclass(frozen=True, eq=False)
class _Step:
    """A step that is to be proved. All rates are by τ, so times h.

    Args:
        margin: The largest |e| for which its bounds hold, shape (n,).
    """

    equations: Equations
    space: Monomials
    frame: Frame
    scale: Array
    h: float
    p: Array
    margin: Array

    def field(self, y: Array) -> Array:
        """Return h f(y), for duals of balls."""
        return objects([self.h * rate for rate in self.equations.field(y)])

    @property
    def middle(self) -> Coefficients:
        """p at z = 0."""
        from flint import arb

        return [[arb(x) for x in row] for row in self.p[:, 0].tolist()]

    def disc(self) -> DiscBounds:
        """Bound f and ∂f/∂y for all z, complex |τ| <= ρ, and |e| within the margin."""
        powers = RATIO ** np.arange(ORDER + 1)
        spread = rounded_up(np.abs(self.p[:, 1:]).sum(axis=1) @ powers)
        # The margin is a distance from p at z = 0.
        return disc_bounds(self.field, self.middle, 1.0, RATIO, rounded_up(spread + self.margin))

    def defect(self, bounds: DiscBounds) -> Array:
        """Bound |hf(p) - p'| for 0 <= τ <= 1 and all z, shape (n,)."""
        terms = ORDER + 1
        models = [Model(self.space, row, np.zeros(terms)) for row in self.p]
        found = np.zeros(len(self.p))
        for i, rate in enumerate(evaluated(self.equations.rates, models)):
            coefficients = self.h * rate.polynomial
            slopes = np.zeros_like(coefficients)
            slopes[:, :-1] = self.p[i][:, 1:] * np.arange(1, terms)
            rounding = 3 * UNIT * (np.abs(coefficients) + np.abs(slopes))
            found[i] = (np.abs(coefficients - slopes) + rounding).sum()
            found[i] += self.h * rate.remainder.sum()
        rest = RATIO**-terms / (1.0 - 1.0 / RATIO)
        bound: Array = rounded_up(found + bounds.rates * rest)
        return bound

    def apart(self, J: JacobianSeries) -> Array:
        """Bound |h∂f/∂y(p + e) - hJ| for all z, 0 <= τ <= 1, |e| in the margin, shape (n, n).

        Higher degrees in z of the states, and e, go into the remainders of their models.
        """
        low = monomials_up_to(self.space.variables, min(JACOBIAN_DEGREE, self.space.degree))
        count, terms = len(low), len(J.middle)
        models = []
        for row, extra in zip(self.p, self.margin.tolist(), strict=True):
            remainder = np.abs(row[count:, :terms]).sum(axis=0)
            remainder[0] += extra
            models.append(Model(low, row[:count, :terms].copy(), rounded_up(remainder)))
        found = rounded_up(2.0 * J.rest + J.radius.sum(axis=0))
        slopes = evaluated(self.equations.jacobian, models)
        for (i, j), slope in zip(self.equations.places, slopes, strict=True):
            change = self.h * slope.polynomial
            size = np.abs(change).sum() + np.abs(J.middle[:, i, j]).sum()
            change[0] -= J.middle[:, i, j]
            whole = np.abs(change).sum() + self.h * slope.remainder.sum() + 3 * UNIT * size
            found[i, j] = rounded_up(found[i, j] + whole)
        return found


def _proved_step(step: _Step, start: MotionSet) -> SetStep | None:
    if not (np.isfinite(step.p).all() and step.h > 0):
        return None
    bounds = step.disc()
    if not bounds.finite:
        return None
    slopes = jacobian_slopes(step.field, step.middle, JACOBIAN_TERMS)
    J = jacobian_series(slopes, JACOBIAN_TERMS, 1.0, RATIO, bounds)
    flow = linear_flow(J, 1.0)
    if not flow.last_term(step.scale) <= MAX_LAST_TERM or not _is_moderate(flow, step, bounds):
        return None
    linear = linear_bounds(flow, step.frame)
    found = _error_bounds(linear, start.radius, step.defect(bounds), step.apart(J), step.margin)
    if found is None:
        return None
    b, W = found
    polynomial = step.p.sum(axis=2)
    size = rounded_up(np.abs(step.p).sum(axis=(1, 2)))
    rounding = (ORDER + 2) * UNIT * size
    beside = rounded_up(linear.mismatch @ b + rounding)
    moved = moved_frame(flow, step.frame, W, beside, step.scale)
    return None if moved is None else SetStep(step.h, MotionSet(start.space, polynomial, *moved))


def _is_moderate(flow: LinearFlow, step: _Step, bounds: DiscBounds) -> bool:
    of_frame = (step.frame.matrix, step.frame.inverse)
    of_flow = (flow.forward, flow.backward, flow.J.middle, flow.J.rest)
    return all_moderate(*of_frame, bounds.jacobian, *of_flow, step.p)


def _error_bounds(
    linear: LinearBounds, radius: Array, d: Array, G: Array, margin: Array
) -> tuple[Array, Array] | None:
    """Return b and W with proved |e| < b and |w| <= W on the whole step; None if none were found.

    Args:
        linear: The bounds of the linear part.
        radius: ω, shape (n,).
        d: h times the bound on the defect, shape (n,).
        G: h times the bound on |J̄ - J| within the margin, shape (n, n).
        margin: The largest b, shape (n,).
    """
    guess = rounded_up(linear.forward @ (radius + linear.backward @ d))
    for _ in range(ATTEMPTS):
        b = 1.1 * guess + 1e-240
        if not np.all(b <= margin):
            return None
        W = rounded_up(radius + linear.residual @ b + linear.backward @ (G @ b + d))
        reached = rounded_up(linear.forward @ W + linear.mismatch @ b)
        if np.all(reached < b):
            return b, W
        guess = np.maximum(guess, reached)
    return None
