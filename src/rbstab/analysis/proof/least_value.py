"""The least value of a reduced energy over a box, from below by proof and from above by example."""

from dataclasses import dataclass

import numpy as np

from rbstab.analysis.proof.boxes import Boxes, joined
from rbstab.analysis.proof.enclosure import SLACK, Enclosure, enclosure
from rbstab.analysis.proof.trigonometric import TrigonometricForm
from rbstab.mechanics.numbers import Array

BATCH = 2048

TOLERANCE = 1e-9
"""The gap that is left between proof and example, over the range of U that was seen."""

FLAT = 1e-6
"""A determinant below this part of its first product is lost in round-off, and is not used."""


@dataclass(frozen=True, eq=False)
class LeastValue:
    """The least value of U over a box.

    value, J, is attained at Theta, shape (3,); lower_bound, J, is proved, and far below value where
    the limit on the number of boxes was reached, so that the gap is not `closed`.
    """

    value: float
    lower_bound: float
    Theta: Array
    examined: int
    closed: bool


@np.errstate(all="ignore")  # no test holds for what is not a number
def least_value(form: TrigonometricForm, box: Boxes, box_limit: int) -> LeastValue:
    """Minimize U over a box by branch and bound.

    Args:
        form: U.
        box: One box; it may be thin along an axis, as a face of the range is.
        box_limit: The number of boxes at which to give up; the lower bound is then a weak one.

    Returns:
        The least value; `closed` says whether the gap is within `TOLERANCE`.
    """
    value, Theta = _descended(form, box, box.centre[0])
    waiting, done, examined, highest = box, np.inf, 0, value
    # The bounds lose this much to rounding in the smallest of boxes.
    round_off = 8 * float(form.round_off[0])
    while len(waiting) and examined < box_limit:
        batch, waiting = waiting[-BATCH:], waiting[:-BATCH]
        examined += len(batch)
        over = enclosure(form, batch)
        best = int(over.value.argmin())
        if over.value[best] < value:
            value, Theta = min(
                (value, Theta),
                _descended(form, box, batch.centre[best]),
                key=lambda found: found[0],
            )
        highest = max(highest, float(over.value.max()))
        lower = lower_bounds(over)
        finished = lower > value - (TOLERANCE * (highest - value) + round_off)
        done = min(done, float(lower[finished].min(initial=np.inf)))
        left = batch[~finished]
        waiting = joined([waiting, left.halves(left.reach.argmax(axis=1))])
    closed = not len(waiting)
    bound = done if closed else min(done, float(lower_bounds(enclosure(form, waiting)).min()))
    return LeastValue(value, min(bound, value), Theta, examined, closed)


def lower_bounds(over: Enclosure) -> Array:
    """U(Θ) >= U(m) + ∇U(m)'δ + ½ δ'H(m)δ - Σ T_ijk r_i r_j r_k / 6 over each box, shape (m,)."""
    r = over.reach
    cubic = np.einsum("mijk,mi,mj,mk->m", over.third, r, r, r) / 6
    rounding = over.value_error + over.gradient_error @ r.T
    rounding = rounding + 0.5 * np.einsum("ij,mi,mj->m", over.hessian_error, r, r)
    drop = np.minimum(_drop_by_magnitudes(over), _drop_by_curvature(over))
    lost = (cubic + rounding + drop) * SLACK
    # The difference of the two is rounded as well.
    return over.value - lost - 1e-15 * (np.abs(over.value) + lost)


def _drop_by_magnitudes(over: Enclosure) -> Array:
    """How far ∇U'δ + ½ δ'Hδ can be below zero, each entry on its own."""
    r, H = over.reach, over.hessian
    slope = np.einsum("mi,mi->m", np.abs(over.gradient), r)
    falling = np.abs(H)
    diagonal = np.arange(3)
    falling[:, diagonal, diagonal] = np.maximum(0.0, -H[:, diagonal, diagonal])
    return slope + 0.5 * np.einsum("mij,mi,mj->m", falling, r, r)


def _drop_by_curvature(over: Enclosure) -> Array:
    """The same where the box is thin along one axis, and H is convex along the other two.

    Unbounded, g'δ + ½ δ'Hδ falls to -½ g'H⁻¹g. What the thin axis does is bounded by magnitudes.
    """
    rows, thin = np.arange(len(over.reach)), over.reach.argmin(axis=1)
    first, second = (thin + 1) % 3, (thin + 2) % 3
    H, g, r = over.hessian, over.gradient, over.reach
    a, b, d = H[rows, first, first], H[rows, first, second], H[rows, second, second]
    p, q = g[rows, first], g[rows, second]
    determinant = a * d - b * b
    convex = (a > 0) & (determinant > FLAT * a * d)
    with np.errstate(all="ignore"):
        squares, product = d * p * p + a * q * q, 2 * b * p * q
        fall = 0.5 * (squares - product + 1e-15 * (squares + np.abs(product))) / determinant
    across = np.einsum("mj,mj->m", np.abs(H[rows, thin]), r) + np.abs(g[rows, thin])
    # Rounding of the determinant is below 1e-15 a d, a 1e-9 th of it.
    return np.where(convex, fall * (1 + 1e-8) + across * r[rows, thin], np.inf)


def _descended(form: TrigonometricForm, box: Boxes, start: Array) -> tuple[float, Array]:
    """A local minimum in the box, near where a descent from a point in it ends."""
    from scipy.optimize import minimize  # late: a search alone does without it

    def value_and_gradient(Theta: Array) -> tuple[float, Array]:
        value, gradient = form.to_round_off(Theta[np.newaxis], 1)
        return float(value[0]), gradient[0]

    limits = list(zip(box.low[0], box.high[0], strict=True))
    to_round_off = {"ftol": 0.0, "gtol": 0.0}
    found = minimize(
        value_and_gradient,
        start,
        jac=True,
        method="L-BFGS-B",
        bounds=limits,
        options=to_round_off,
    )
    return float(found.fun), np.clip(found.x, box.low[0], box.high[0])
