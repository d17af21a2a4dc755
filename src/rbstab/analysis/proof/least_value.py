"""The minimum of a reduced energy over a box: an attained value and a proved lower bound."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rbstab.analysis.proof.box_bounds import Enclosure
from rbstab.analysis.proof.boxes import ROUNDING_FACTOR, Boxes, joined
from rbstab.analysis.proof.enclosure import enclosure
from rbstab.analysis.proof.guards.bounds import GuardedEnclosure, KinkedEnclosure
from rbstab.analysis.proof.guards.kinks import kinks_of
from rbstab.analysis.proof.traced.energy import FormulaPart
from rbstab.analysis.proof.traced.kinked import KinkedEnergy
from rbstab.analysis.proof.trigonometric import TrigonometricForm
from rbstab.mechanics.numbers import Array

BATCH = 2048

FEW, FURTHER = 64, 2
"""So few boxes are halved so many times more if the energy has a formula of a user: each of its
operations is a call of numpy, which takes as long for one box as for a hundred."""

TOLERANCE = 1e-9
"""The allowed gap between lower bound and attained value, relative to the found max U - min U."""

MIN_DETERMINANT_FRACTION = 1e-6
"""A determinant below this fraction of its first product may be round-off and is not used."""


@dataclass(frozen=True, eq=False)
class LeastValue:
    """The minimum of U over a box.

    value, J, is attained at Theta, shape (3,). lower_bound, J, is proved. If the limit on the
    number of boxes was reached, it can be far below value, and `closed` is false.
    """

    value: float
    lower_bound: float
    Theta: Array
    examined: int
    closed: bool


@np.errstate(all="ignore")  # comparisons with NaN are false
def least_value(form: TrigonometricForm, box: Boxes, box_limit: int) -> LeastValue:
    """Minimize U over a box by branch and bound.

    Args:
        form: U.
        box: One box; it may be thin along an axis, as a face of the range is.
        box_limit: The number of boxes at which the search stops; the lower bound is then weak.

    Returns:
        The minimum; `closed` is true if the gap is within `TOLERANCE`.
    """
    value, Theta = local_minimum(form, box, box.centre[0])
    pending, finished_bound, examined, highest = box, np.inf, 0, value
    # Even in the smallest boxes, rounding lowers the bounds by this much.
    round_off = 8 * form.noise[0]
    while len(pending) and examined < box_limit:
        batch, pending = pending[-BATCH:], pending[:-BATCH]
        examined += len(batch)
        enclosed = enclosure(form, batch)
        best = int(enclosed.value.argmin())
        if enclosed.value[best] < value:
            value, Theta = min(
                (value, Theta),
                local_minimum(form, box, batch.centre[best]),
                key=lambda found: found[0],
            )
        highest = max(highest, float(enclosed.value.max()))
        lower = lower_bounds(enclosed)
        finished = lower > value - (TOLERANCE * (highest - value) + round_off)
        finished_bound = min(finished_bound, float(lower[finished].min(initial=np.inf)))
        pending = joined([pending, _parts(batch[~finished], form)])
    closed = not len(pending)
    bound = (
        finished_bound
        if closed
        else min(finished_bound, float(lower_bounds(enclosure(form, pending)).min()))
    )
    return LeastValue(value, min(bound, value), Theta, examined, closed)


def _parts(boxes: Boxes, form: TrigonometricForm) -> Boxes:
    """Return the halves of boxes, or smaller parts where a call takes longer than its boxes."""
    found = boxes.halves(boxes.radius.argmax(axis=1))
    if any(isinstance(line, FormulaPart) for line in form.lines):
        for _ in range(FURTHER):
            if len(found) > FEW:
                break
            found = found.halves(found.radius.argmax(axis=1))
    return found


def lower_bounds(enclosed: Enclosure) -> Array:
    """Bound U from below over each box, shape (m,).

    U(Θ) >= U(m) + ∇U(m)'δ + ½ δ'H(m)δ - Σ T_ijk r_i r_j r_k / 6. Where that is no number, nothing
    is known: -inf. A minimum over boxes would drop what is no number.
    """
    r = enclosed.radius
    cubic = np.einsum("mijk,mi,mj,mk->m", enclosed.third, r, r, r) / 6
    drop = np.minimum(_drop_by_magnitudes(enclosed), _drop_by_curvature(enclosed))
    lost = (cubic + enclosed.error + drop) * ROUNDING_FACTOR
    # The subtraction is rounded too.
    bounds = enclosed.value - lost - 1e-15 * (np.abs(enclosed.value) + lost)
    bounds = np.where(np.isnan(bounds), -np.inf, bounds)
    if enclosed.kinks is not None and enclosed.kinks.below is not None:
        bounds = np.fmax(bounds, lower_bounds(enclosed.kinks.below))
    if not isinstance(enclosed, GuardedEnclosure):
        return bounds
    bare, added = lower_bounds(enclosed.bare), enclosed.energy[:, 0]
    apart = bare + added - 1e-15 * (np.abs(bare) + np.abs(added))
    bounds = np.fmax(bounds, apart)  # a bound that is no number is left out
    if isinstance(enclosed, KinkedEnclosure):
        bounds = np.fmax(bounds, lower_bounds(enclosed.supported))
    return bounds


def upper_bounds(enclosed: Enclosure) -> Array:
    """Bound U from above over each box, shape (m,): by the lower bound of -U."""
    return -lower_bounds(enclosed.negated())


def _drop_by_magnitudes(enclosed: Enclosure) -> Array:
    """Bound how far ∇U'δ + ½ δ'Hδ can be below zero, by a bound on each term."""
    r, H = enclosed.radius, enclosed.hessian
    slope = np.einsum("mi,mi->m", np.abs(enclosed.gradient), r)
    falling = np.abs(H)
    diagonal = np.arange(3)
    falling[:, diagonal, diagonal] = np.maximum(0.0, -H[:, diagonal, diagonal])
    return slope + 0.5 * np.einsum("mij,mi,mj->m", falling, r, r)


def _drop_by_curvature(enclosed: Enclosure) -> Array:
    """Return the same bound by completing the square, for boxes that are thin along one axis.

    H must be convex along the other two axes; else the bound is infinite. The unbounded minimum of
    g'δ + ½ δ'Hδ is -½ g'H⁻¹g. The terms of the thin axis are bounded by their magnitudes.
    """
    rows, thin = np.arange(len(enclosed.radius)), enclosed.radius.argmin(axis=1)
    first, second = (thin + 1) % 3, (thin + 2) % 3
    H, g, r = enclosed.hessian, enclosed.gradient, enclosed.radius
    a, b, d = H[rows, first, first], H[rows, first, second], H[rows, second, second]
    p, q = g[rows, first], g[rows, second]
    determinant = a * d - b * b
    convex = (a > 0) & (determinant > MIN_DETERMINANT_FRACTION * a * d)
    with np.errstate(all="ignore"):
        squares, product = d * p * p + a * q * q, 2 * b * p * q
        fall = 0.5 * (squares - product + 1e-15 * (squares + np.abs(product))) / determinant
    across = np.einsum("mj,mj->m", np.abs(H[rows, thin]), r) + np.abs(g[rows, thin])
    # The determinant's rounding error is below 1e-15 a d, at most 1e-9 of the determinant.
    return np.where(convex, fall * (1 + 1e-8) + across * r[rows, thin], np.inf)


def local_minimum(form: TrigonometricForm, box: Boxes, start: Array) -> tuple[float, Array]:
    """Return U and Θ near a local minimum in the box, by a descent from a point in it.

    Where a guard jumps, U is not smooth: the descent goes on along its angle.
    """
    valleys = [one for one in form.kinks if not one.ridge]
    if valleys:
        value, Theta = _valley_minimum(form, valleys, box, start)
    else:
        value, Theta = _smooth_minimum(form, box, start)
    for kink in kinks_of(form.guard):
        if box.low[0, 1] < kink.angle < box.high[0, 1]:
            flat = Boxes(box.low.copy(), box.high.copy())
            flat.low[0, 1] = flat.high[0, 1] = kink.angle
            along = np.array([Theta[0], kink.angle, Theta[2]])
            held = _smooth_minimum(form, flat, along)
            value, Theta = min((value, Theta), held, key=lambda pair: pair[0])
    return value, Theta


def _valley_minimum(
    form: TrigonometricForm, valleys: Sequence[KinkedEnergy], box: Boxes, start: Array
) -> tuple[float, Array]:
    """Return a local minimum of U with parts max(h, 0): that of F + Σ t with t >= h and t >= 0.

    There is none on a ridge, so a descent passes ridges as if they were smooth.
    """
    from scipy.optimize import minimize

    others = replace(form, lines=tuple(line for line in form.lines if line not in valleys))
    arguments = [valley.argument for valley in valleys]
    size, count = max(form.noise[0] / np.finfo(float).eps, np.finfo(float).tiny), len(arguments)

    def value_and_gradient(y: Array) -> tuple[float, Array]:
        value, gradient = others.approximate(y[np.newaxis, :3], 1)
        slopes = np.concatenate([gradient[0], np.ones(count) * size])
        return float(value[0]) / size + float(y[3:].sum()), slopes / size

    def scaled(Theta: Array) -> Array:
        """Return h of each part, in the unit of t."""
        found = [float(h.approximate(Theta[np.newaxis], 0)[0][0]) for h in arguments]
        return np.array(found) / size

    def rooms(y: Array) -> Array:
        found: Array = y[3:] - scaled(y[:3])
        return found

    def slopes_of_rooms(y: Array) -> Array:
        slopes = [h.approximate(y[np.newaxis, :3], 1)[1][0] / size for h in arguments]
        return np.concatenate([-np.array(slopes), np.eye(count)], axis=1)

    limits = [*zip(box.low[0], box.high[0], strict=True), *[(0.0, None)] * count]
    found = minimize(
        value_and_gradient,
        np.concatenate([start, np.maximum(scaled(start), 0.0)]),
        jac=True,
        method="SLSQP",
        bounds=limits,
        constraints={"type": "ineq", "fun": rooms, "jac": slopes_of_rooms},
        options={"ftol": 1e-16, "maxiter": 200},
    )
    Theta = np.clip(found.x[:3], box.low[0], box.high[0])
    if not np.all(np.isfinite(Theta)):
        Theta = start
    return float(form.value(Theta[np.newaxis])[0]), Theta


def _smooth_minimum(form: TrigonometricForm, box: Boxes, start: Array) -> tuple[float, Array]:
    from scipy.optimize import minimize  # imported late: a search without a proof does not need it

    def value_and_gradient(Theta: Array) -> tuple[float, Array]:
        value, gradient = form.approximate(Theta[np.newaxis], 1)
        return float(value[0]), gradient[0]

    limits = list(zip(box.low[0], box.high[0], strict=True))
    no_early_stop = {"ftol": 0.0, "gtol": 0.0}
    found = minimize(
        value_and_gradient,
        start,
        jac=True,
        method="L-BFGS-B",
        bounds=limits,
        options=no_early_stop,
    )
    return float(found.fun), np.clip(found.x, box.low[0], box.high[0])
