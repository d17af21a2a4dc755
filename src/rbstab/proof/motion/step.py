"""One step of all motions from a set: P(z) + Qw with |z| <= 1 and |w| <= ω, and such a set later.

On the step, y = p + e with a polynomial p in z and in τ = t/h: one for each start. All rates are by
τ. Let y' = h f(y) + δ with |δ| <= D; then

    e' = J̄e + (hf(p) - p') + δ,    e(0) = Qw,

where J̄ is the mean of h∂f/∂y between p and p + e. Φ and Ψ are polynomials near the fundamental
matrix of e' = Je and its inverse, for a polynomial J near J̄ at z = 0. With w(τ) = Q⁻¹Ψe,

    w' = Q⁻¹(Ψ' + ΨJ)e + Q⁻¹Ψ((J̄ - J)e + hf(p) - p' + δ),    e = ΦQw + (I - ΦΨ)e.

A, C, G and d bound |Q⁻¹| ∫|Ψ' + ΨJ|, |Q⁻¹Ψ|, |J̄ - J| and |hf(p) - p'| + D, while |e| is within a
margin. Then |e| is below b on the whole step and |w| at most W, as soon as b is within the margin
and

    W = ω + A b + C (G b + d),    |ΦQ| W + |I - ΦΨ| b < b

in every component: e is continuous, starts below b, and cannot be the first to reach it. δ need not
be continuous, so motions through switches are steps too (`crossing`). `docs/proofs.md` has the
proof (R. Lohner, 1988, for the frames).
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.motion.equations import Field
from rbstab.proof.motion.linear_flow import (
    LinearBounds,
    frames_of,
    linear_bounds,
    linear_flow,
    turned_frames,
)
from rbstab.proof.motion.models import Models, Proved
from rbstab.proof.motion.monomials import Monomials, monomials_up_to
from rbstab.proof.motion.motion_set import MotionSet
from rbstab.proof.motion.rounding import LARGEST, UNIT, error_of_products, rounded_up
from rbstab.proof.motion.series import node_series, summed


class Accuracy(NamedTuple):
    """How long the polynomials of a step are.

    Attributes:
        order: The highest power of τ in p.
        terms: The number of terms of J, and the degree of Φ and Ψ.
        tolerance: The size of the last terms of p, relative to the scale of a state.
    """

    order: int
    terms: int
    tolerance: float


OF_POINTS = Accuracy(20, 16, 1e-14)
"""Of the motion from a single start."""

OF_SETS = Accuracy(12, 10, 1e-12)
"""Of larger sets, whose steps are short in any case: at the ends of a set J is another."""

JACOBIAN_DEGREE = 3
"""The highest degree in z of the models of ∂f/∂y."""

MAX_LAST_TERM = 1e-8
"""The norm of the last term of Φ, in scaled states. It decides the length of a step where the
system is stiff and its motion slow."""

MARGIN = 1e-8
"""The least |e| for which a step is bounded, relative to the scale of a state."""

GROWTH = 2.0
"""The largest |e| for which a step is bounded, relative to that at its beginning."""

SHARE = 0.03
"""A step may widen the set about a single start by this fraction through its own estimates. Near
the longest step that can be proved, they add a quarter with each step, and the width grows
exponentially. In a larger set most of G is the spread of ∂f/∂y over its starts, and not the fault
of the step: with this limit steps would become shorter without end."""

LONGER = 1.5
"""A step may be longer than the one before by this factor."""

ATTEMPTS = 12
"""Attempts to find the bound b of one step."""

TIME_GRID = 2.0**-40
"""s: steps are multiples of this, so that the times of many steps are sums without rounding."""


class Disturbance(NamedTuple):
    """What bounds |δ|.

    Attributes:
        bound: Returns D, shape (sets, n), for all states of a tube of models.
        expected: A guess at it; it makes the margin wide enough.
    """

    bound: Callable[[Models], Array]
    expected: Array


class SetSteps(NamedTuple):
    """Steps of several sets.

    Attributes:
        h: Their lengths, shape (sets,), s.
        p: The coefficients of τᵏ z^α, shape (terms, n, sets, monomials).
        distance: b, shape (sets, n): each motion is within b of p on the whole step.
        end: The sets at their ends.
        proved: Whether each step is proved, shape (sets,); otherwise nothing else has a meaning.
    """

    h: Array
    p: Array
    distance: Array
    end: MotionSet
    proved: Array

    def longest_after(self, longest: Array) -> Array:
        """Return the largest steps to be tried after these, of at most some lengths, s."""
        return np.where(self.proved, LONGER * self.h, longest / 2)

    def tube(self, space: Monomials) -> Models:
        """Return the states on the whole steps as models."""
        return Models(space, self.p, np.ascontiguousarray(self.distance.T))

    def at(self, time: float) -> tuple[Array, Array]:
        """Return bounds on all states of the first set at a time of its step, each of shape (n,).

        Args:
            time: The time from the beginning of the step, s, rounded at most twice.
        """
        p, powers = self.p[:, :, 0], np.arange(len(self.p))
        centre = (time / self.h[0]) ** powers @ p[..., 0]
        aside = np.abs(p[..., 1:]).sum(axis=0).sum(axis=-1)
        rounding = 8 * len(p) * UNIT * ((1.0 + powers) @ np.abs(p[..., 0]))
        reach = rounded_up(self.distance[0] + aside + rounding)
        return np.nextafter(centre - reach, -np.inf), np.nextafter(centre + reach, np.inf)


def set_steps(
    field: Field,
    start: MotionSet,
    scale: Array,
    longest: Array,
    disturbance: Disturbance | None = None,
) -> SetSteps:
    """Prove one step of all motions from each of several sets.

    Where no bounds were found, a shorter step or a smaller set may succeed.

    Args:
        field: The equations.
        start: The sets.
        scale: The size of each state, shape (n,); the choice has no effect on what is proved.
        longest: The largest steps, shape (sets,), s.
        disturbance: Finds D from all states within the margin; default D = 0.
    """
    with np.errstate(all="ignore"):  # a number that is not finite fails every test below
        h, series, lows = _series(field, start, scale, longest)
        margin = GROWTH * start.error + MARGIN * scale
        if disturbance is not None:
            reached = (disturbance.expected / scale).max(axis=-1) * h  # one state moves others
            margin = margin + 2.0 * GROWTH * reached[:, np.newaxis] * scale
        n, p = len(scale), series[:, : len(scale)]
        first = field.rates if start.space.variables else field.step
        proved = Proved(first, start.space, series)
        d = _defect(p, proved.results(np.zeros_like(margin.T))[:n], h)
        if disturbance is not None:
            tube = Models(start.space, p, np.ascontiguousarray(margin.T))
            d = rounded_up(d + h[:, np.newaxis] * disturbance.bound(tube))
        if start.space.variables:
            proved = Proved(field.step, _low(start.space), lows)
        left_out = np.abs(p[..., len(_low(start.space)) :]).sum(axis=0).sum(axis=-1)
        slopes = proved.results(rounded_up(margin.T + left_out))[n:]
        J, G = _jacobian(slopes, field.places, n, h)
        flow, frame = linear_flow(J), frames_of(start.frame)
        linear = linear_bounds(flow, frame)
        share = SHARE if disturbance is None and not start.space.variables else 1.0
        b, W, bounded = _error_bounds(linear, start.radius, d, G, margin, share)
        size = rounded_up(np.abs(p).sum(axis=0).sum(axis=-1)).T
        beside = rounded_up(_times(linear.mismatch, b) + (len(p) + 1) * UNIT * size)
        Phi, error = flow.forward.sum(axis=-3), error_of_products(np.abs(flow.forward).sum(axis=-3))
        end = turned_frames(Phi, error, frame, (W, beside), scale)
        entries = (frame.matrix, frame.inverse, flow.forward, flow.backward, J, G, *end)
        usable = np.all([_are_moderate(part) for part in entries], axis=0)
        usable = usable & bounded & (h > 0) & (size <= LARGEST).all(axis=-1)
        polynomial = np.ascontiguousarray(p.sum(axis=0).swapaxes(0, 1))
    return SetSteps(h, p, b, MotionSet(start.space, polynomial, *end), usable)


def _series(
    field: Field, start: MotionSet, scale: Array, longest: Array
) -> tuple[Array, Array, Array]:
    """Return the length of each step, and the series in τ of the nodes of `rates` and `step`."""
    given = start.polynomial.swapaxes(0, 1)[np.newaxis]
    order, terms, tolerance = _accuracy(start.space)
    # With one monomial, there is no use in fewer nodes.
    first = field.rates if start.space.variables else field.step
    values = node_series(first, start.space, given, longest, order)
    # The series of `step` have lower degrees in z.
    low = _low(start.space)
    lows = node_series(field.step, low, np.ascontiguousarray(values[..., : len(low)]))
    n, factor = len(scale), np.ones(len(start))
    for k in (order - 1, order):
        size = (np.abs(values[k, :n]).sum(axis=-1) / scale[:, np.newaxis]).max(axis=0)
        factor = np.minimum(factor, (tolerance / np.maximum(size, 1e-300)) ** (1.0 / k))
    slopes = summed(field.step.results, lows[:terms])[:, n:, :, 0]
    last = linear_flow(_matrices(slopes, field.places, n) * longest[:, None, None, None])
    factor = np.minimum(factor, (MAX_LAST_TERM / last.last_term(scale)) ** (1.0 / terms))
    h = np.floor(longest * factor / TIME_GRID) * TIME_GRID
    # p is what these products are; p at τ = 0 stays as it is.
    powers = ((h / longest) ** np.arange(order + 1)[:, np.newaxis])[:, np.newaxis, :, np.newaxis]
    return h, values * powers, lows * powers


def _accuracy(space: Monomials) -> Accuracy:
    return OF_SETS if space.variables else OF_POINTS


def _low(space: Monomials) -> Monomials:
    return monomials_up_to(space.variables, min(JACOBIAN_DEGREE, space.degree))


def _defect(p: Array, rates: Models, h: Array) -> Array:
    """Bound |hf(p) - p'| for 0 <= τ <= 1 and all z, shape (sets, n), from the models of f(p)."""
    coefficients, slopes = h[:, np.newaxis] * rates.polynomial, np.zeros_like(p)
    slopes[:-1] = p[1:] * np.arange(1, len(p))[:, None, None, None]
    rounding = 3 * UNIT * (np.abs(coefficients) + np.abs(slopes))
    apart = (np.abs(coefficients - slopes) + rounding).sum(axis=0).sum(axis=-1)
    bound: Array = rounded_up(apart + h * rates.remainder).T
    return bound


def _jacobian(slopes: Models, places: Array, n: int, h: Array) -> tuple[Array, Array]:
    """Return J, h∂f/∂y along p at z = 0, and G, from the models of ∂f/∂y within the margin."""
    # High powers of τ are left out of J.
    terms = _accuracy(slopes.space).terms
    middle, rest = h * slopes.polynomial[:terms, ..., 0], slopes.polynomial.copy()
    rest[:terms, ..., 0] = 0.0
    size = np.abs(rest).sum(axis=0).sum(axis=-1) + slopes.remainder
    bound = h * size + 2 * UNIT * np.abs(middle).sum(axis=0)
    # G bounds |h∂f/∂y(p + e) - J| for all z, 0 <= τ <= 1 and |e| within the margin.
    G = np.zeros((len(h), n, n))
    G[:, places[0], places[1]] = rounded_up(bound).T
    return _matrices(middle, places, n), G


def _matrices(entries: Array, places: Array, n: int) -> Array:
    """Return matrices, shape (sets, terms, n, n), from their entries, (terms, entries, sets)."""
    matrices = np.zeros((entries.shape[2], len(entries), n, n))
    matrices[:, :, places[0], places[1]] = entries.transpose(2, 0, 1)
    return matrices


def _are_moderate(entries: Array) -> Array:
    """Return for each set whether the bounds on rounding errors hold for all its entries."""
    return np.asarray((np.abs(entries) <= LARGEST).reshape(len(entries), -1).all(axis=1))


def _times(matrix: Array, vector: Array) -> Array:
    return (matrix @ vector[..., np.newaxis])[..., 0]


def _error_bounds(  # noqa: PLR0913, PLR0917 (the parts of one inequality)
    linear: LinearBounds, radius: Array, d: Array, G: Array, margin: Array, share: float = SHARE
) -> tuple[Array, Array, Array]:
    """Return b and W, and whether it is proved that |e| < b and |w| <= W on the whole step."""
    # ω is `radius`, and d bounds the defect and δ; like b and `margin`, the largest b, they have
    # the shape (sets, n). G, shape (sets, n, n), bounds |J̄ - J| within the margin. At most the
    # part `share` of W may come from A b + C G b.
    guess = rounded_up(_times(linear.forward, radius + _times(linear.backward, d)))
    best_b, best_W = np.zeros_like(guess), np.zeros_like(guess)
    bounded = np.zeros(len(guess), dtype=bool)
    for _ in range(ATTEMPTS):
        b = 1.1 * guess + 1e-240
        by_b = _times(linear.residual, b) + _times(linear.backward, _times(G, b))
        W = rounded_up(radius + by_b + _times(linear.backward, d))
        reached = rounded_up(_times(linear.forward, W) + _times(linear.mismatch, b))
        new = ~bounded & np.all((reached < b) & (b <= margin) & (by_b <= share * W), axis=-1)
        best_b[new], best_W[new] = b[new], W[new]
        bounded |= new
        if bounded.all():
            break
        guess = np.maximum(guess, reached)
    return best_b, best_W, bounded
