"""Gates on the border: where a growing component of {U < c} can first touch it.

At such a point U has a local minimum on the border, and falls from there into the inside. All
other parts of the border are left out by the signs of derivatives, with proof.
"""

from itertools import islice
from typing import NamedTuple

import numpy as np

from rbstab.analysis.proof.boxes import ROUNDING_FACTOR, Boxes, hulls, joined, no_boxes, whole_range
from rbstab.analysis.proof.certified_region import Face, border_of
from rbstab.analysis.proof.enclosure import enclosure
from rbstab.analysis.proof.least_value import local_minimum, lower_bounds, upper_bounds
from rbstab.analysis.proof.regions.downhill import Landscape
from rbstab.analysis.proof.regions.gates import Gate
from rbstab.analysis.proof.trigonometric import TrigonometricForm
from rbstab.mechanics.numbers import Array

BATCH = 2048
BOX_LIMIT = 60_000

SMALLEST = 1e-4
"""rad: boxes on a face with a radius below this are not halved again; they make a gate."""

DEPTHS = (0.3, 0.1, 0.03, 0.01, 3e-3, 1e-3)
"""rad: the lengths that are tried for the first way inwards from a gate."""

MAX_DESCENTS = 3
"""So many of these lengths are tried with a whole way down."""

SLICES = 16
MARGIN = 1e-6
"""rad: a gate reaches this far beyond its boxes, so that it is a neighbourhood on the border."""


class BorderGate(NamedTuple):
    """A gate on the border, and its box: small boxes in one hull, with a margin."""

    gate: Gate
    box: Boxes


def border_gates(landscape: Landscape, cap: float) -> list[BorderGate] | None:
    """Return the gates on the border below a level, lowest first; their `ends` are not known.

    Args:
        landscape: The energy, its minima, and the range.
        cap: Gates at this level or above are left out, J.

    Returns:
        The gates; None if the limit on the number of boxes was reached.
    """
    form, found = landscape.form, []
    for face in border_of(form):
        suspects = _suspects(landscape, face, cap)
        if suspects is None:
            return None
        for hull in _each(hulls(suspects)):
            enclosed = enclosure(form, suspects[suspects.within(hull)])
            low, high = float(lower_bounds(enclosed).min()), float(upper_bounds(enclosed).max())
            energy, Theta = local_minimum(form, hull, hull.centre[0])
            gate = Gate(energy, low, high, Theta, face=face)
            found.append(BorderGate(gate, _widened(hull, face, landscape.end)))
    return sorted(found, key=lambda one: one.gate.lower_bound)


def minimum_inside(landscape: Landscape, border: BorderGate) -> frozenset[int] | None:
    """Return the minimum to which the way inwards from a gate leads; None if not proved."""
    gate, face = border.box, border.gate.face
    assert face is not None
    slabs = (_slab(gate, face, depth) for depth in DEPTHS)
    falling = (slab for slab in slabs if _falls_inwards(landscape.form, slab, face))
    for slab in islice(falling, MAX_DESCENTS):
        found = landscape.reached_minimum(_far_side(slab, face), border.gate.lower_bound)
        if found is not None:
            return frozenset([found])
    return None


@np.errstate(all="ignore")  # comparisons with NaN are false
def _suspects(landscape: Landscape, face: Face, cap: float) -> Boxes | None:
    """Return small boxes that contain each possible gate on a face; None beyond the box limit."""
    form, end = landscape.form, landscape.end
    pending, kept, examined = face.box_of(end), [no_boxes()], 0
    while len(pending):
        batch, pending = pending[-BATCH:], pending[:-BATCH]
        examined += len(batch)
        if examined > BOX_LIMIT:
            return None
        enclosed = enclosure(form, batch)
        spread = np.einsum("mkj,mj->mk", np.abs(enclosed.hessian), enclosed.radius)
        spread = (spread + enclosed.curvature) * ROUNDING_FACTOR
        low, high = enclosed.gradient - spread, enclosed.gradient + spread
        left = ~(lower_bounds(enclosed) >= cap) & ~_cannot_touch(face, batch, low, high, end)
        batch = batch[left]
        small = batch.radius.max(axis=1, initial=0.0) < SMALLEST
        kept.append(batch[small])
        pending = joined([pending, batch[~small].halves(batch[~small].radius.argmax(axis=1))])
    return joined(kept)


def _cannot_touch(face: Face, boxes: Boxes, low: Array, high: Array, end: Array) -> Array:
    """Return whether no component can first touch the border in each box, shape (m,).

    Args:
        face: The face.
        boxes: Boxes on it.
        low: Lower bounds of ∇U over each box, shape (m, 3).
        high: Upper bounds.
        end: As for `border_gates`.
    """
    normal, sign = face.value
    outwards = (low if sign > 0 else -high)[:, normal], (high if sign > 0 else -low)[:, normal]
    # U falls outwards along the normal: then it is lower on the border than beside it.
    excluded = outwards[1] < 0
    # U falls inwards: at an edge, this is a direction along the other face.
    inwards = outwards[0] > 0
    for axis in {0, 1, 2} - {normal}:
        # U falls along the face: in a direction in which it goes on, or it ends at an edge.
        falls_back = (low[:, axis] > 0) & (inwards | (boxes.low[:, axis] > -end[axis]))
        falls_ahead = (high[:, axis] < 0) & (inwards | (boxes.high[:, axis] < end[axis]))
        excluded = excluded | falls_back | falls_ahead
    return excluded


def _slab(gate: Boxes, face: Face, depth: float) -> Boxes:
    """Return a gate's box, extended inwards."""
    normal, sign = face.value
    low, high = gate.low.copy(), gate.high.copy()
    extended = low if sign > 0 else high
    extended[:, normal] -= sign * depth
    return Boxes(low, high)


def _far_side(slab: Boxes, face: Face) -> Boxes:
    """Return the side of a slab from which the way inwards goes on."""
    normal, sign = face.value
    low, high = slab.low.copy(), slab.high.copy()
    if sign > 0:
        high[:, normal] = low[:, normal]
    else:
        low[:, normal] = high[:, normal]
    return Boxes(low, high)


def _falls_inwards(form: TrigonometricForm, slab: Boxes, face: Face) -> bool:
    """Return whether U falls inwards all through a slab at a face, proved."""
    normal, sign = face.value
    cuts = np.linspace(slab.low[0, normal], slab.high[0, normal], SLICES + 1)
    low, high = slab.low.repeat(SLICES, axis=0), slab.high.repeat(SLICES, axis=0)
    low[:, normal], high[:, normal] = cuts[:-1], cuts[1:]
    enclosed = enclosure(form, Boxes(low, high))
    spread = np.einsum("mj,mj->m", np.abs(enclosed.hessian[:, normal]), enclosed.radius)
    spread = (spread + enclosed.curvature[:, normal]) * ROUNDING_FACTOR
    outwards = sign * enclosed.gradient[:, normal]
    return bool(np.all(outwards - spread > 0))


def _widened(hull: Boxes, face: Face, end: Array) -> Boxes:
    """Return a gate's hull with a margin along the face, inside the border."""
    normal, _ = face.value
    margin = np.full(3, MARGIN)
    margin[normal] = 0.0
    whole = whole_range(end)
    low, high = hull.low - margin, hull.high + margin
    return Boxes(np.maximum(low, whole.low), np.minimum(high, whole.high))


def _each(boxes: Boxes) -> list[Boxes]:
    return [boxes[k : k + 1] for k in range(len(boxes))]
