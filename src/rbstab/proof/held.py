"""Rest states at which a force that jumps, or a stop, holds the body.

L(Θ, λ) is the energy with λ in place of one step(h). Its gradient by Θ is that of U with a share λ
of the jump, and its slope by λ is the jump in energy, which is zero where h = 0. So the body rests
on the surface h = 0 where ∇L = 0 and 0 < λ < 1: the same search, with one more variable. The jump
may be zero elsewhere too, so that h = 0 is proved (`_Surface._on_it`).
At a stop, θ2 is a number, and ∂U/∂θ2 has to press against it.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.boxes import Box, Boxes, joined, one_box
from rbstab.proof.enclosures.bounds import UP, BoundedEnergy, Bounds, preconditioned
from rbstab.proof.enclosures.intervals import Intervals, constant
from rbstab.proof.exact.expr import STEP, VAR, Atom, atom, expr, variable
from rbstab.proof.exact.rewriting import substituted
from rbstab.proof.model import Energy
from rbstab.proof.search import Search, Test, Zeros
from rbstab.proof.zeros import Zero, have_zeros, index_of, newton

LAMBDA = 1000
"""The number of the variable λ."""

GRID = (7, 6, 7)
"""The points of a range, by axis, from which states on a surface are looked for."""

UPWARDS = np.array([0.0, 1.0, 0.0])
"""Across the surface at which a stop holds θ2."""

RADII = np.geomspace(1e-14, 0.5, 100)

FACE_LIMIT = 20_000
"""Boxes of one face at a stop."""


def jumps(energy: Energy) -> list[Atom]:
    """Return the steps at which the force jumps, in order."""
    found = [a for a in energy.U.all_atoms if a.kind == STEP and a.extra == 1]
    return sorted(found, key=lambda a: a.order)


def held_zeros(energy: Energy, box: Box, starts: Array | None = None) -> list[Zero]:
    """Return rest states in a box at which a force that jumps holds the body.

    Args:
        energy: U; nothing is found if variables besides Θ are left.
        box: The box of Θ.
        starts: Points from which they are looked for, shape (3, points); a grid by default.
    """
    if energy.free:
        return []
    if starts is None:
        lines = [np.linspace(a, b, n + 2)[1:-1] for a, b, n in zip(*box, GRID, strict=True)]
        starts = np.stack([x.ravel() for x in np.meshgrid(*lines, indexing="ij")])
    found = list[Zero]()
    for step in jumps(energy):
        surface = _Surface(energy, step)
        for x in surface.candidates(starts):
            inside = box.contains(x[:3])
            if inside and not any(zero.domain.contains(x[:3]) for zero in found):
                zero = surface.isolated(x)
                found += [] if zero is None else [zero]
    return found


def out_of_balance(energy: Energy) -> Test | None:
    """Return a test for `Search`: that no share of any jump balances the other forces in boxes.

    With A and A + B the energies on both sides of a surface, a body at rest there or beside it has
    ∇A + λ∇B = 0 for a λ from 0 to 1, so ∇A and ∇B are parallel: their cross product is zero.
    """
    sides = []
    for step in [] if energy.free else jumps(energy):
        A = substituted(energy.U, {step: expr(0)})
        B = substituted(energy.U, {step: expr(1)}) - A
        sides.append([BoundedEnergy(one, least=energy.least, order=2) for one in (A, B)])
    if not sides:
        return None

    def test(boxes: Boxes, bounds: Bounds) -> Array:
        found = np.zeros(boxes.count, dtype=bool)
        at = np.flatnonzero(~np.all(np.isfinite(bounds.slope.rad), axis=(0, 1)))  # at a surface
        if len(at):
            for A, B in sides:
                a, b = (one.over(boxes.lo[:, at], boxes.hi[:, at]).slopes for one in (A, B))
                for i, j in ((0, 1), (1, 2), (2, 0)):
                    one, two = a[i] * b[j], a[j] * b[i]
                    found[at] |= (one.lo > two.hi) | (one.hi < two.lo)
        return found

    return test


class _Surface:
    """The surface h = 0 on which a step changes."""

    def __init__(self, energy: Energy, step: Atom) -> None:
        L = substituted(energy.U, {step: variable(LAMBDA)})
        self.energy = BoundedEnergy(L, (0, 1, 2, LAMBDA), least=energy.least)
        self.argument = BoundedEnergy(step.inner, least=energy.least)

    def candidates(self, starts: Array) -> Iterator[Array]:
        """Yield points (Θ, λ) where ∇L is zero to round-off, with λ between 0 and 1."""
        ends, last = newton(self.energy, np.vstack([starts, np.full(starts.shape[1], 0.5)]), 60)
        good = (last < 1e-11) & (ends[3] > 0) & (ends[3] < 1)
        yield from ends[:, good].T

    def isolated(self, x: Array) -> Zero | None:
        """Prove that the body rests at exactly one point near this one."""
        lo, hi = x[:3, None] - RADII, x[:3, None] + RADII
        near = x[3] - 10 * RADII, x[3] + 10 * RADII
        ends = np.vstack([lo, near[0]]), np.vstack([hi, near[1]])
        small = self.energy.over(*ends)
        normal = self.argument.at(x[:3, None])[1][:, 0]
        with np.errstate(all="ignore"):
            # On both sides of the surface U has slopes across it, of opposite signs.
            before, after = (
                self.energy.over(np.vstack([lo, share]), np.vstack([hi, share])).slopes
                for share in (np.zeros_like(RADII), np.ones_like(RADII))
            )
            b, a = _along(normal, before), _along(normal, after)
            pulls, pushes = (b.hi < 0) & (a.lo > 0), (b.lo > 0) & (a.hi < 0)
            low, high = _shares(b, a)
            wide = self.energy.over(np.vstack([lo, low]), np.vstack([hi, high]))
            _, _, _, hessian = preconditioned(wide)
            unique = np.all(np.einsum("ijm,jm->im", hessian, wide.radius) * UP < wide.radius, 0)
            exists = have_zeros(small, *ends) & (near[0] > 0) & (near[1] < 1)
        domains = unique & (pulls | pushes)
        good = np.flatnonzero(domains & exists)
        if not len(good):
            return None
        e, d = int(good[0]), int(np.flatnonzero(domains)[-1])
        if not self._on_it(Boxes(lo, hi), e, normal, domains):
            return None
        ridge = bool(pushes[e])
        index = index_of(small.hessian, e)
        # ∇²L has one negative eigenvalue more than the Hessian along the surface.
        return Zero(
            x[:3],
            Box(lo[:, e], hi[:, e]),
            Box(lo[:, d], hi[:, d]),
            None if index is None else index - 1 + ridge,
            float(small.value.mid[e]),
            normal=normal,
            ridge=ridge,
        )

    def _on_it(self, boxes: Boxes, e: int, normal: Array, domains: Array) -> bool:
        """Prove that h = 0 where the jump in energy is zero in the e-th box.

        In a domain this jump rises or falls strictly along the normal n. If h reaches 0 there along
        the line through this point, as n'∇h is large enough, the jump is zero at no other point.
        """
        h = self.argument.over(boxes.lo, boxes.hi)
        with np.errstate(all="ignore"):
            way = h.value_over.mag[e] / _along(normal, h.slopes).lo * np.abs(normal).max()
            return bool(np.any(domains & (way >= 0) & (way < 0.9 * (RADII - RADII[e]))))


def _shares(b: Intervals, a: Intervals) -> tuple[Array, Array]:
    """Bound the λ with (1 - λ) b + λ a = 0, for b and a of opposite signs; 0 and 1 for others."""
    rising, falling = (b.hi < 0) & (a.lo > 0), (b.lo > 0) & (a.hi < 0)
    b_least, b_most = np.where(rising, -b.hi, b.lo), np.where(rising, -b.lo, b.hi)
    a_least, a_most = np.where(rising, a.lo, -a.hi), np.where(rising, a.hi, -a.lo)
    low, high = b_least / (b_least + a_most) / UP, b_most / (b_most + a_least) * UP
    known = (rising | falling) & np.isfinite(low) & np.isfinite(high)
    return np.where(known, low, 0.0), np.where(known, np.minimum(high, 1.0), 1.0)


def _along(normal: Array, g: Intervals) -> Intervals:
    """Return bounds on n'∇L for the three angles."""
    mid = np.einsum("i,im->m", normal, g.mid[:3])
    rad = np.einsum("i,im->m", np.abs(normal), g.rad[:3] + 1e-14 * np.abs(g.mid[:3])) * UP
    return Intervals(mid - rad, mid + rad)


def zeros_at_stop(energy: Energy, box: Box) -> list[Zeros]:
    """Return the rest states at each end of θ2 that a stop holds, proved or not.

    They are the zeros of ∂U/∂θ1 and ∂U/∂θ3 on the face at which U falls outwards. Their boxes have
    three axes. Where the sign of ∂U/∂θ2 is not known, a box is undecided.
    """
    if energy.stop is None:
        return []
    return [_zeros_on_face(energy, box, side) for side in (-1, 1)]


def _zeros_on_face(energy: Energy, box: Box, side: int) -> Zeros:
    assert energy.stop is not None
    ends = constant(side * energy.stop)
    face = substituted(energy.U, {atom(VAR, 1): expr(side * energy.stop)})
    on_face = BoundedEnergy(face, (0, 2), free=energy.free)
    whole = BoundedEnergy(energy.U, free=energy.free, least=energy.least)

    def whole_boxes(boxes: Boxes) -> Boxes:
        low, high = (np.broadcast_to(end, boxes.lo[:1].shape) for end in ends)
        return Boxes(
            np.concatenate([boxes.lo[:1], low, boxes.lo[1:]]),
            np.concatenate([boxes.hi[:1], high, boxes.hi[1:]]),
        )

    def outwards(boxes: Boxes) -> Intervals:
        g = whole.over(*whole_boxes(boxes)).slopes[1]
        return g if side > 0 else Intervals(-g.hi, -g.lo)

    def leaves(boxes: Boxes, _: Bounds) -> Array:
        return outwards(boxes).lo > 0

    flat = Box(box.lo[[0, 2]], box.hi[[0, 2]])
    found = Search(on_face, flat, also=leaves).run(FACE_LIMIT)
    zeros, undecided = list[Zero](), [whole_boxes(found.undecided)]
    for zero in found.zeros:
        place = one_box(zero.enclosure)
        slope, at = outwards(place), whole_boxes(place)
        if slope.hi[0] < 0:
            point = np.array([zero.point[0], side * float(energy.stop), zero.point[1]])
            around = Box(at.lo[:, 0], at.hi[:, 0])
            zeros.append(
                replace(zero, point=point, enclosure=around, domain=around, normal=UPWARDS)
            )
        elif not slope.lo[0] > 0:
            undecided.append(at)
    return Zeros(tuple(zeros), joined(undecided, 3), found.examined, found.family)
