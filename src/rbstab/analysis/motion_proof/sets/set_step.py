"""One step of all motions from a set: P(z) + Qw with |z| <= 1 and |w| <= ω, and such a set later.

As in `motion_proof.step`, but p is a polynomial in τ = t/h and in z: one for each start. All rates
are by τ. Φ and Ψ belong to p at z = 0, and J is h∂f/∂y there. For each z, J̄ is the mean of h∂f/∂y
between p and p + e. Taylor models of ∂f/∂y on the whole set give a bound G on |J̄ - J|, and d bounds
|hf(p) - p'|. Then, as there, |e| is below b on the whole step and |w| at most W, as soon as

    W = ω + A b + C (G b + d),    |ΦQ| W + |I - ΦΨ| b < b.

`docs/proofs.md` has the proof.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rbstab.analysis.motion_proof.linear_flow import (
    Frame,
    LinearBounds,
    frames_of,
    linear_bounds,
    linear_flow,
)
from rbstab.analysis.motion_proof.rounding import LARGEST, rounded_up
from rbstab.analysis.motion_proof.sets.discs import Discs, discs_of
from rbstab.analysis.motion_proof.sets.equations import Equations
from rbstab.analysis.motion_proof.sets.models import UNIT, Model, evaluated
from rbstab.analysis.motion_proof.sets.monomials import Monomials, monomials_up_to
from rbstab.analysis.motion_proof.sets.motion_set import MotionSet
from rbstab.analysis.motion_proof.sets.series import Series
from rbstab.analysis.motion_proof.step import moved_frames
from rbstab.analysis.motion_proof.taylor import DiscBounds, JacobianSeries
from rbstab.mechanics.numbers import Array


class Orders(NamedTuple):
    """How far the series of a step go. It has no effect on what is proved, once a step is.

    Attributes:
        order: The highest power of τ in p.
        jacobian_terms: The number of terms of ∂f/∂y, at most order + 1, and the degree of Φ and Ψ.
        ratio: ρ: Cauchy's estimates hold for complex |τ| up to ρ. A smaller ρ makes steps longer.
    """

    order: int
    jacobian_terms: int
    ratio: float


FOR_SETS = Orders(order=12, jacobian_terms=12, ratio=8.0)
"""For sets of starts: on short steps |Φ| and |Ψ| let the error grow less."""

FOR_POINTS = Orders(order=16, jacobian_terms=12, ratio=5.0)
"""For single starts: fewer, longer steps."""

JACOBIAN_DEGREE = 3
"""The highest degree in z of the models of ∂f/∂y."""

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


class SetSteps(NamedTuple):
    """Steps of several sets.

    Attributes:
        h: Their lengths, shape (sets,), s.
        end: The sets at their ends.
        proved: Whether each step is proved, shape (sets,); otherwise its end means nothing.
    """

    h: Array
    end: MotionSet
    proved: Array


def set_steps(
    equations: Equations,
    start: MotionSet,
    scale: Array,
    longest: Array,
    orders: Orders = FOR_SETS,
) -> SetSteps:
    """Prove one step of all motions from each of several sets.

    Where no bounds were found, a shorter step or a smaller set may succeed.

    Args:
        equations: The equations.
        start: The sets.
        scale: The size of each state, shape (n,); the choice has no effect on what is proved.
        longest: The largest steps, shape (sets,), s.
        orders: How far the series go.
    """
    with np.errstate(all="ignore"):  # a number that is not finite fails every test below
        h, p = _polynomial(equations, start, scale, longest, orders.order)
        margin = rounded_up(GROWTH * start.error + MARGIN * scale)
        frame = frames_of(start.frame)
        step = _Steps(equations, start.space, frame, scale, h, p, margin, orders)
        return _proved_steps(step, start)


def _polynomial(
    equations: Equations, start: MotionSet, scale: Array, longest: Array, order: int
) -> tuple[Array, Array]:
    """Return the length of each step, and p, shape (sets, n, monomials, order + 1)."""
    p = Series(equations.rates, start.space, order).of(start.polynomial, longest)
    factor = np.ones(len(p))
    for k in (order - 1, order):
        size = (np.abs(p[..., k]).sum(axis=-1) / scale).max(axis=-1)
        factor = np.minimum(factor, (TOLERANCE / np.maximum(size, 1e-300)) ** (1.0 / k))
    # p is what these products are; p at τ = 0 stays as it is.
    h = longest * factor
    powers = (h / longest)[:, np.newaxis] ** np.arange(order + 1)
    return h, p * powers[:, np.newaxis, np.newaxis, :]


@dataclass(frozen=True, eq=False)
class _Steps:
    """Steps that are to be proved. All rates are by τ, so times h.

    Args:
        margin: The largest |e| for which their bounds hold, shape (sets, n).
    """

    equations: Equations
    space: Monomials
    frame: Frame
    scale: Array
    h: Array
    p: Array
    margin: Array
    orders: Orders

    def disc(self) -> DiscBounds:
        """Bound hf and h∂f/∂y for all z, complex |τ| <= ρ, and |e| within the margin."""
        powers = self.orders.ratio ** np.arange(self.orders.order + 1)
        size = np.abs(self.p)
        size[..., 0, 0] = 0.0  # that is the centre
        radius = rounded_up((size @ powers).sum(axis=-1) + self.margin)
        n = self.p.shape[1]
        states = [Discs(self.p[:, i, 0, 0], radius[:, i]) for i in range(n)]
        rates = [rate.bound for rate in discs_of(self.equations.rates, states)]
        slopes = discs_of(self.equations.jacobian, states)
        jacobian = np.zeros((len(self.p), n, n))
        for (i, j), slope in zip(self.equations.places, slopes, strict=True):
            jacobian[:, i, j] = slope.bound
        h = self.h[:, np.newaxis]
        return DiscBounds(
            rounded_up(h * np.stack(rates, axis=-1)), rounded_up(h[..., np.newaxis] * jacobian)
        )

    def defect(self, bounds: DiscBounds) -> Array:
        """Bound |hf(p) - p'| for 0 <= τ <= 1 and all z, shape (sets, n)."""
        terms, n = self.p.shape[-1], self.p.shape[1]
        zero = np.zeros((len(self.p), terms))
        models = [Model(self.space, self.p[:, i], zero) for i in range(n)]
        found = np.zeros((len(self.p), n))
        for i, rate in enumerate(evaluated(self.equations.rates, models)):
            coefficients = self.h[:, np.newaxis, np.newaxis] * rate.polynomial
            slopes = np.zeros_like(coefficients)
            slopes[..., :-1] = self.p[:, i, :, 1:] * np.arange(1, terms)
            rounding = 3 * UNIT * (np.abs(coefficients) + np.abs(slopes))
            found[:, i] = _totals(np.abs(coefficients - slopes) + rounding)
            found[:, i] += self.h * rate.remainder.sum(axis=-1)
        rest = _rest(self.orders.ratio, terms)
        bound: Array = rounded_up(found + bounds.rates * rest)
        return bound

    def jacobian(self, bounds: DiscBounds) -> tuple[JacobianSeries, Array]:
        """Return J = h∂f/∂y along p at z = 0, and G.

        G, shape (sets, n, n), bounds |h∂f/∂y(p + e) - J| for all z, 0 <= τ <= 1 and |e| within the
        margin. Higher degrees in z of the states, and e, go into the remainders of their models.
        """
        low = monomials_up_to(self.space.variables, min(JACOBIAN_DEGREE, self.space.degree))
        sets, n, count = len(self.p), self.p.shape[1], len(low)
        terms = self.orders.jacobian_terms
        models = []
        for i in range(n):
            remainder = np.abs(self.p[:, i, count:, :terms]).sum(axis=-2)
            remainder[:, 0] += self.margin[:, i]
            polynomial = np.ascontiguousarray(self.p[:, i, :count, :terms])
            models.append(Model(low, polynomial, rounded_up(remainder)))
        middle, radius = np.zeros((2, sets, terms, n, n))
        rest = rounded_up(bounds.jacobian * _rest(self.orders.ratio, terms))
        G = np.zeros((sets, n, n))
        slopes = evaluated(self.equations.jacobian, models)
        h = self.h[:, np.newaxis]
        for (i, j), slope in zip(self.equations.places, slopes, strict=True):
            middle[:, :, i, j] = h * slope.polynomial[:, 0]
            radius[:, :, i, j] = h * slope.remainder + 2 * UNIT * np.abs(middle[:, :, i, j])
            G[:, i, j] = self.h * _totals(np.abs(slope.polynomial[:, 1:]))
        radius = rounded_up(radius)
        # Both lie within `radius` of the polynomial, and both have a rest of the series in τ.
        return JacobianSeries(middle, radius, rest), rounded_up(
            G + 2.0 * radius.sum(axis=1) + 2.0 * rest
        )


def _proved_steps(step: _Steps, start: MotionSet) -> SetSteps:
    bounds = step.disc()
    J, G = step.jacobian(bounds)
    flow = linear_flow(J, 1.0)
    linear = linear_bounds(flow, step.frame)
    of_frame = (step.frame.matrix, step.frame.inverse)
    of_flow = (flow.forward, flow.backward, J.middle, J.rest)
    entries = (*of_frame, *of_flow, bounds.jacobian, bounds.rates, step.p)
    usable = np.all([_is_moderate(part) for part in entries], axis=0)
    usable = usable & (step.h > 0) & (flow.last_term(step.scale) <= MAX_LAST_TERM)
    b, W, found = _error_bounds(linear, start.radius, step.defect(bounds), G, step.margin)
    polynomial = step.p.sum(axis=-1)
    size = rounded_up(np.abs(step.p).sum(axis=(-2, -1)))
    beside = rounded_up(_times(linear.mismatch, b) + (step.p.shape[-1] + 1) * UNIT * size)
    frame, radius = moved_frames(flow, step.frame, W, beside, step.scale)
    proved = usable & found & np.isfinite(radius).all(axis=-1)
    return SetSteps(step.h, MotionSet(start.space, polynomial, frame, radius), proved)


def _totals(entries: Array) -> Array:
    """Return the sum of all entries of each set.

    They are added in one order, however they lie in memory: numpy's order for a sum over several
    axes depends on it, and with it on the number of sets.
    """
    totals: Array = np.ascontiguousarray(entries).reshape(len(entries), -1).sum(axis=-1)
    return totals


def _rest(ratio: float, terms: int) -> float:
    """Return the sum of ρ⁻ᵏ for all k from `terms` on, rounded up."""
    return float(rounded_up(ratio**-terms / (1.0 - 1.0 / ratio)))


def _is_moderate(entries: Array) -> Array:
    """Return for each set whether the bounds on rounding errors hold for all its entries."""
    return np.asarray((np.abs(entries) <= LARGEST).reshape(len(entries), -1).all(axis=1))


def _times(matrix: Array, vector: Array) -> Array:
    return (matrix @ vector[..., np.newaxis])[..., 0]


def _error_bounds(
    linear: LinearBounds, radius: Array, d: Array, G: Array, margin: Array
) -> tuple[Array, Array, Array]:
    """Return b and W, and whether it is proved that |e| < b and |w| <= W on the whole step.

    Args:
        linear: The bounds of the linear part.
        radius: ω, shape (sets, n).
        d: The bound on the defect, shape (sets, n).
        G: The bound on |J̄ - J| within the margin, shape (sets, n, n).
        margin: The largest b, shape (sets, n).
    """
    guess = rounded_up(_times(linear.forward, radius + _times(linear.backward, d)))
    best_b, best_W = np.zeros_like(guess), np.zeros_like(guess)
    found = np.zeros(len(guess), dtype=bool)
    for _ in range(ATTEMPTS):
        b = 1.1 * guess + 1e-240
        inner = _times(G, b) + d
        W = rounded_up(radius + _times(linear.residual, b) + _times(linear.backward, inner))
        reached = rounded_up(_times(linear.forward, W) + _times(linear.mismatch, b))
        new = ~found & np.all((reached < b) & (b <= margin), axis=-1)
        best_b[new], best_W[new] = b[new], W[new]
        found |= new
        if found.all():
            break
        guess = np.maximum(guess, reached)
    return best_b, best_W, found
