"""All real θ1 and θ3: a box that contains all rest states (theorem 6 of docs/proofs.md).

U = ½x'kx + b(θ2)'x + p(Θ) with x = [θ1, θ3], where p is periodic in θ1 and θ3. There ∂U/∂x = 0 is

    k x = -(b(θ2) + ∂p/∂x)

with |θ2| <= π/2. So |k⁻¹| times the largest magnitudes on the right bounds |θ1| and |θ3|; a search
over one period bounds the slopes of p.
"""

from dataclasses import replace

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import PITCH
from rbstab.proof.boxes import Box, as_boxes, joined
from rbstab.proof.enclosures.bounds import UP, BoundedEnergy
from rbstab.proof.enclosures.intervals import constant
from rbstab.proof.enclosures.tied import bounds_of
from rbstab.proof.exact.atoms import COS, SIN, VAR, Atom
from rbstab.proof.exact.expr import Expr, variable
from rbstab.proof.exact.matrices import inverse_of_definite
from rbstab.proof.exact.rewriting import Quadratic, quadratic_in
from rbstab.proof.model import RANGE_END, Energy

OUTER = (0, 2)
"""The angles θ1 and θ3, which are never wrapped."""

MARGIN = 1.001
"""Factor on the bounds of θ1 and θ3, so that no rest state is near the border."""

ENOUGH = 0.98
"""A search for bounds on slopes aims at this share of the largest ones for the least ends."""

TIGHT = 0.15
"""Bounds on slopes may be so much above slopes that occur, relatively."""

LIMIT = 12_000
"""Boxes of the search for bounds on slopes."""

PERIOD = RANGE_END[0]


def parts_of(U: Expr) -> Quadratic | None:
    """Return U as ½x'kx + b'x + p for x = [θ1, θ3]; None if x stands in it otherwise.

    k is constant, b is a polynomial of θ2, and p is periodic in θ1 and θ3.
    """
    if any(a.kind == VAR and power < 0 for m in U.terms for a, power in m):
        return None
    parts = quadratic_in(U, OUTER, (VAR,))
    of_pitch = all(b.variables <= {PITCH} for b in parts.b)
    return parts if of_pitch and all(_is_periodic(a) for a in parts.rest.atoms) else None


def _is_periodic(a: Atom) -> bool:
    """Return whether θ1 and θ3 are in sines and cosines alone, of themselves."""
    if a.kind == VAR:
        return a.argument not in OUTER
    if a.kind in {SIN, COS} and a.inner in (variable(0), variable(2)):
        return True
    return all(_is_periodic(b) for b in a.inner.atoms)


def confined(energy: Energy, V: BoundedEnergy | None = None) -> Array | None:
    """Return bounds on |θ1| and |θ3| at rest, shape (2,), rad; None if none are found.

    Args:
        energy: U.
        V: Bounds on U; by default those of `energy`.
    """
    parts = None if energy.closed & set(OUTER) else parts_of(energy.U)
    if parts is None:
        return None
    inverse = inverse_of_definite(parts.H)
    if inverse is None:
        return None
    compliance = np.array([[abs(float(x)) for x in row] for row in inverse]) * UP
    end = end_of_pitch(energy)
    load = UP * np.array([_largest(b, end) for b in parts.b])
    # Wide enough that U is most likely higher at its ends than at θ2 = ±π/2; this needs no proof.
    height = _height(V or bounds_of(energy), energy)
    climb = np.sqrt(2.0 * height * np.diag(compliance))
    least = np.maximum(climb, PERIOD)
    enough = ENOUGH * np.linalg.pinv(compliance) @ (least / MARGIN) - load
    slopes = _steepest(replace(energy, U=_sloping(parts.rest)), end, np.maximum(enough, 0.0))
    bounds = np.maximum(compliance @ (load + slopes) * MARGIN, least)
    return bounds if np.all(np.isfinite(bounds)) else None


def end_of_pitch(energy: Energy) -> float:
    """Return the largest |θ2| in the range, rad, rounded up: that of a stop, or π/2."""
    return 0.5 * PERIOD if energy.stop is None else float(constant(energy.stop)[1, 0])


def _largest(b: Expr, end: float) -> float:
    """Bound the magnitude of a polynomial of θ2 for |θ2| <= end."""
    return sum(abs(float(c)) * end ** sum(p for _, p in m) for m, c in b.terms.items())


def _sloping(p: Expr) -> Expr:
    """Return what depends on more than θ2."""
    return Expr({m: c for m, c in p.terms.items() if any(a.variables - {1} for a, _ in m)})


def _height(V: BoundedEnergy, energy: Energy) -> float:
    """Return an estimate of how far U is at θ2 = ±π/2 above its least value, J."""
    if 1 in energy.closed:
        return 0.0
    end = end_of_pitch(energy)
    points = np.random.default_rng(0).uniform(-1, 1, (3, 64)) * [[1.0], [end], [1.0]]
    points[:, :2] = [[0.0, 0.0], [-end, end], [0.0, 0.0]]
    values = V.at(points)[0]
    return max(0.0, float(np.nanmax(values[:2]) - np.nanmin(values)))


def _steepest(energy: Energy, end: float, enough: Array) -> Array:
    """Bound |∂p/∂θ1| and |∂p/∂θ3| over one period, shape (2,), J/rad; infinite if unbounded."""
    p = bounds_of(energy, order=2)
    corner = np.array([PERIOD, end, PERIOD])
    pending, places = as_boxes(Box(-corner, corner)), list(OUTER)
    reached, settled, examined = np.zeros(2), np.zeros(2), 0
    while pending.count:
        boxes, pending = pending[slice(1024)], pending[slice(1024, None)]
        late, examined = examined >= LIMIT, examined + boxes.count
        b = p.over(boxes.lo, boxes.hi)
        with np.errstate(invalid="ignore"):
            at = np.abs(b.gradient.mid[places])
            reached = np.maximum(reached, np.where(np.isfinite(at), at, 0.0).max(axis=1))
        size = b.slopes.mag[places]
        # Bounds below those that are enough are not made sharper.
        wanted = np.maximum(enough, reached * (1 + TIGHT) + 1e-12)
        done = np.all(size <= wanted[:, None], axis=0) | late
        settled = np.maximum(settled, size[:, done].max(axis=1, initial=0.0))
        pending = joined([boxes[~done].halved(), pending], 3)
    return np.asarray(settled * UP)
