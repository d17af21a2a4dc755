"""The bounds on a reduced energy over boxes (`box_bounds`), with all that is added to its form.

Lines add theirs (`LinePart.over`), and so do guards of θ2 (`guards/bounds.py`). Where the slope of
an element of a user jumps, there are bounds with all of its slopes, and with one of them.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rbstab.analysis.proof.box_bounds import Enclosure, Jumps
from rbstab.analysis.proof.boxes import ROUNDING_FACTOR, Boxes
from rbstab.analysis.proof.guards.bounds import guarded
from rbstab.analysis.proof.lines.intervals import Intervals, stacked, total
from rbstab.analysis.proof.lines.over_boxes import at_centres
from rbstab.analysis.proof.trigonometric import TrigonometricForm
from rbstab.mechanics.numbers import Array

SWEEPS = 8
"""So often each λ of several kinks is improved."""


def enclosure(form: TrigonometricForm, boxes: Boxes) -> Enclosure:
    """Compute the bounds over boxes, about their centres."""
    if form.kinks:
        return _with_kinks(form, boxes)
    return _guarded(form, _bare_enclosure(form.unguarded, boxes), boxes)


def _guarded(form: TrigonometricForm, bare: Enclosure, boxes: Boxes) -> Enclosure:
    """Add the guards of a form to bounds on all else."""
    return bare if form.guard is None else guarded(bare, form.guard, boxes)


def _bare_enclosure(form: TrigonometricForm, boxes: Boxes) -> Enclosure:
    """Compute the bounds of a form without a barrier."""
    if form.lines:
        return _enclosure_with_lines(form, boxes)
    radius = boxes.radius
    value, gradient, hessian, third = form.rigorous(boxes.centre, 3)
    drift = np.einsum("kijl,ml->mkij", form.fourth_derivative_bound, radius)
    return Enclosure(
        radius,
        value.values,
        value.error,
        gradient.values,
        gradient.error,
        hessian.values,
        hessian.error,
        (np.abs(third.values) + third.error + drift) * ROUNDING_FACTOR,
    )


def _enclosure_with_lines(form: TrigonometricForm, boxes: Boxes) -> Enclosure:
    """Compute the bounds of a form with lines; terms of opposite signs are taken together."""
    return _sum_of(_smooth_parts(form, boxes), boxes)


def _smooth_parts(form: TrigonometricForm, boxes: Boxes) -> list[list[Intervals]]:
    """Return the bounds on a form and on each of its lines without kinks."""
    t, smooth = form.basis(boxes.centre), form.without_kinks.lines
    return [at_centres(form, t, boxes), *(line.over(t, boxes) for line in smooth)]


def _sum_of(parts: Sequence[list[Intervals]], boxes: Boxes) -> Enclosure:
    """Add bounds over boxes, as `LinePart.over` returns them."""
    value, gradient, hessian, third = (total(part) for part in zip(*parts, strict=True))
    return Enclosure(
        boxes.radius,
        value.middle,
        value.radius,
        gradient.middle,
        gradient.radius,
        hessian.middle,
        hessian.radius,
        third.size,
    )


@np.errstate(all="ignore")  # an entry that is no number has no bound
def _with_kinks(form: TrigonometricForm, boxes: Boxes) -> Enclosure:
    """Compute the bounds of a form with lines whose slopes jump."""
    smooth = [total(part) for part in zip(*_smooth_parts(form, boxes), strict=True)]
    found = [kink.bounds(boxes) for kink in form.kinks]

    def summed(parts: Sequence[list[Intervals]]) -> Enclosure:
        return _guarded(form, _sum_of([smooth, *parts], boxes), boxes)

    whole = summed([one.whole for one in found])
    jumps = np.stack([one.jumps for one in found], axis=1)
    if not np.any(jumps):
        return whole
    acts = np.stack([one.acts for one in found], axis=1).astype(float)
    inner = summed([one.times(acts[:, k]) for k, one in enumerate(found)])
    slopes = np.stack([one.slopes.middle for one in found], axis=1)
    best = _best_shares(inner.gradient, np.where(jumps[..., None], slopes, 0.0), boxes.radius)
    share = np.where(jumps, best, acts)
    shared = [one.times(share[:, k]) for k, one in enumerate(found)]
    flat = below = summed(shared)
    ridges = [k for k, one in enumerate(found) if one.ridge and np.any(jumps[:, k])]
    if ridges:
        below = summed([one.whole if k in ridges else shared[k] for k, one in enumerate(found)])
    over = stacked([one.slopes_over for one in found])
    over.middle[~jumps], over.radius[~jumps] = 0.0, 0.0
    return replace(whole, kinks=Jumps(np.any(jumps, axis=1), flat, below, share, over))


def _best_shares(gradient: Array, slopes: Array, radius: Array) -> Array:
    """Return λ between 0 and 1 for which U + Σ λ_i h_i is flat in each box, shape (m, n).

    That is, for which the entries of gradient + Σ λ_i slopes_i, times the radii, are small.
    """
    share, left = np.zeros(slopes.shape[:2]), gradient * radius
    slopes = slopes * radius[:, np.newaxis]
    squares = np.maximum(np.einsum("mnk,mnk->mn", slopes, slopes), np.finfo(float).tiny)
    for _ in range(SWEEPS if slopes.shape[1] > 1 else 1):
        for k in range(slopes.shape[1]):
            step = np.einsum("mk,mk->m", left, slopes[:, k]) / squares[:, k]
            changed = np.nan_to_num(np.clip(share[:, k] - step, 0.0, 1.0))
            left += (changed - share[:, k])[:, None] * slopes[:, k]
            share[:, k] = changed
    return share
