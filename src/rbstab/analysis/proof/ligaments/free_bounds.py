"""Proved bounds on the least energy V(Θ) of ligaments over the position, over boxes of Θ.

Let m be the centre of a box, δ = Θ - m, ẑ near the z at m, and C near ∂z/∂Θ there. The variable
ζ = z - ẑ - Cδ is small on the box, however far z moves. With W(Θ, ζ) = ½ z'Sz + Σ G_j, derivatives
along Θ at constant ζ, and H = W_ζζ,

    ∂V/∂θ_i = W_i        ∂²V/∂θ_i∂θ_j = W_ij - W_iζ H⁻¹ W_ζj        where W_ζ = 0.

Let ζ = Bξ. If `lowest_point` bounds ζ with B'HB >= λ, then |W_iζ H⁻¹ W_ζj| is at most
|B'W_iζ| |B'W_jζ|/λ (docs/proofs.md, lemma 14).

All of this holds for any ẑ, C and B: only its sharpness depends on them. B is first chosen so that
B'HB is 1 at m. Where that proves nothing, as the directions of stiff ligaments change too much, it
is chosen so that B'SB is 1 to round-off. With a lower bound λ of its eigenvalues, |ξ| <= |B'g|/λ at
any distance, since H >= S.

With u = e/|e|, the tension T of a ligament, q = T/ℓ, M = T′ - q, the slopes e,i = r,i + C_i and
b_i = u'e,i, its parts are

    W_ζ: Tu    W_i: T u'r,i    W_ij: T u'r,ij + q e,i'e,j + M b_i b_j    W_iζ: q e,i + M b_i u

and H: qI + Muu'. Those of ½ z'Sz are Sz, 0 (with W_ζ = 0), C_i'SC_j, SC_i and S. The slopes of a
stiff ligament are nearly perpendicular to it: so b_i is small, and s = ℓ² changes little on the
box. Therefore s is bounded by its own slopes 2e'e,i.
"""

from typing import NamedTuple

import numpy as np

from rbstab.analysis.proof.boxes import Boxes
from rbstab.analysis.proof.ligaments.free import FreeLigament, FreeLigaments
from rbstab.analysis.proof.lines.directions import direction, products
from rbstab.analysis.proof.lines.intervals import (
    Intervals,
    between,
    exact,
    near,
    rounded,
    stacked,
    total,
)
from rbstab.analysis.proof.lines.over_boxes import at_centres, over_boxes
from rbstab.analysis.proof.lowest_point import (
    WIDER,
    load,
    lost,
    lowest_point,
    norm,
    product,
    scaling,
    size_of,
    turned,
    widths_of,
)
from rbstab.mechanics.numbers import Array

UNIT = np.eye(3)

ROOM = 2.0
"""The bounds that are tried for ξ are so many times |B'g|."""


class _Offset(NamedTuple):
    """The three entries of r of a ligament, at the centres and over the boxes.

    Each is a list of the derivatives of order 0 to 2: shapes (m, 3), (m, 3, 3), (m, 3, 3, 3).
    """

    ligament: FreeLigament
    at_centre: list[Intervals]
    over: list[Intervals]


class _Parts(NamedTuple):
    """The parts of the derivatives of W of one ligament over the boxes.

    along is T u'r,ij + q e,i'e,j + M b_i b_j, and mixed q e,i + M b_i u, its second index that of
    the angle, both of shape (m, 3, 3). across is q, excess M, and squared ℓ², of shape (m,).
    """

    along: Intervals
    mixed: Intervals
    across: Intervals
    excess: Intervals
    direction: Intervals
    squared: Intervals


def parts_over(free: FreeLigaments, t: Array, boxes: Boxes) -> list[Intervals]:
    """Return V and its slopes at the centres, its Hessian over the boxes, and no third derivatives.

    Args:
        free: V.
        t: The basis of the forms at the centres.
        boxes: The boxes of Θ.
    """
    return _Enclosure(free, t, boxes).parts


def value_at(free: FreeLigaments, Theta: Array) -> Intervals:
    """Return V at points, shape (m,)."""
    return _about(free, Boxes(Theta, Theta)).value


def squares_over(free: FreeLigaments, boxes: Boxes) -> list[Intervals]:
    """Return the square of the length of each ligament over boxes, with the z of V, shape (m,)."""
    return _about(free, boxes).squares


def _about(free: FreeLigaments, boxes: Boxes) -> "_Enclosure":
    """Return the bounds over boxes, from their centres alone."""
    highest = max(free.forms, key=lambda form: len(form.coefficients))
    return _Enclosure(free, highest.basis(boxes.centre), boxes)


class _Enclosure:
    """The bounds over some boxes.

    Args:
        free: V.
        t: The basis of the forms at the centres.
        boxes: The boxes of Θ.
    """

    def __init__(self, free: FreeLigaments, t: Array, boxes: Boxes) -> None:
        self.radius = boxes.radius
        self.S = rounded(free.stiffness)
        self.offsets = [_offset(ligament, t, boxes) for ligament in free.ligaments]
        self.z = exact(free.shift(boxes.centre))
        self.e = [one.at_centre[0] + self.z for one in self.offsets]
        pulls = [one.ligament.pull(e) for one, e in zip(self.offsets, self.e, strict=True)]
        self.g = total([(self.S * self.z[:, np.newaxis, :]).sum(2), *pulls])
        soft = scaling(free.stiffness[np.newaxis])
        self.soft = np.broadcast_to(soft, (len(self.radius), 3, 3))
        # B'SB is 1 to round-off, which is larger for an S of very different eigenvalues.
        scaled = product(product(turned(soft), self.S), exact(soft))
        deviation = (scaled + exact(-UNIT)).size.sum(axis=2).max() * WIDER
        self.soft_least = float(1 - deviation) if deviation < 1 else np.nan
        self.C, self.stiff = self._chosen(free.stiffness)
        self.SC = product(self.S, self.C)

    @property
    def value(self) -> Intervals:
        """V at the centres: at most ½ |B'g|²/λ below W at ζ = 0, with B'SB >= λ."""
        stored = near(0.5) * ((self.S * self.z[:, np.newaxis, :]).sum(2) * self.z).sum(1)
        lines = [
            one.ligament.law.bounds(e.square().sum(1), 0)[0]
            for one, e in zip(self.offsets, self.e, strict=True)
        ]
        found = total([stored, *lines])
        below = 0.5 * size_of(self.soft, self.g.size) ** 2 / self.soft_least * WIDER
        return Intervals(found.middle, (found.radius + below) * WIDER)

    @property
    def parts(self) -> list[Intervals]:
        """See `parts_over`."""
        nothing = exact(np.zeros((len(self.radius), 3, 3, 3)))
        return [self.value, self._gradient, self._hessian, nothing]

    @property
    def _gradient(self) -> Intervals:
        """∂V/∂Θ at the centres, with the ζ at which ∂W/∂ζ = 0."""
        widths = widths_of(self.soft, size_of(self.soft, self.g.size) / self.soft_least)
        zeta = Intervals(np.zeros_like(widths), widths)
        moments = []
        for one, e in zip(self.offsets, self.e, strict=True):
            pull = one.ligament.pull(e + zeta)
            moments.append((pull[:, :, np.newaxis] * one.at_centre[1]).sum(1))
        return total(moments)

    @property
    def squares(self) -> list[Intervals]:
        """ℓ² of each ligament over the boxes."""
        return [one.squared for one in self._at_lowest()[2]]

    @property
    def _hessian(self) -> Intervals:
        """The Hessian of V over the boxes."""
        B, least, parts = self._at_lowest()
        mixed = total([self.SC, *(one.mixed for one in parts)])
        found = total([product(_transposed(self.C), self.SC), *(one.along for one in parts)])
        return Intervals(found.middle, (found.radius + lost(B, mixed, least)) * WIDER)

    def _at_lowest(self) -> tuple[Array, Array, list[_Parts]]:
        """Return B, λ, and the parts over the boxes, for all ζ at which W may be lowest."""
        nothing = np.zeros_like(self.radius)
        B, least, widths = self._shifts(self._parts(Intervals(nothing, nothing)))
        return B, least, self._parts(Intervals(nothing, widths))

    def _shifts(self, at_zero: list[_Parts]) -> tuple[Array, Array, Array]:
        """Return B, λ, and bounds on |ζ| over the boxes, shape (m, 3)."""
        mixed = total([self.SC, *(one.mixed for one in at_zero)])
        loads = load(self.stiff, self.g, mixed, self.radius)
        proved, sharp, least = lowest_point(self.stiff, loads, ROOM, self._bend)
        B = np.where(proved[:, np.newaxis, np.newaxis], self.stiff, self.soft)
        softly = load(self.soft, self.g, mixed, self.radius)
        rough = widths_of(self.soft, norm(softly) / self.soft_least)
        widths = np.where(proved[:, np.newaxis], np.fmin(sharp, rough), rough)
        return B, np.where(proved, least, self.soft_least), widths

    def _bend(self, widths: Array) -> Intervals:
        """Return bounds on B'HB with B = `stiff`, for |ζ| <= widths, shape (m, 3, 3)."""
        parts = self._parts(Intervals(np.zeros_like(widths), widths))
        transposed = turned(self.stiff)
        BB = product(transposed, exact(self.stiff))
        found = [product(product(transposed, self.S), exact(self.stiff))]
        for one in parts:
            u = product(transposed, one.direction[:, :, np.newaxis])[:, :, 0]
            found.append(one.across[:, np.newaxis, np.newaxis] * BB)
            found.append(one.excess[:, np.newaxis, np.newaxis] * products(u))
        return total(found)

    def _parts(self, zeta: Intervals) -> list[_Parts]:
        """Return the parts of each ligament over the boxes, for all ζ in a box."""
        found = []
        for one, centre in zip(self.offsets, self.e, strict=True):
            law, slopes = one.ligament.law, one.over[1] + self.C
            start = centre + zeta
            spread = np.einsum("mki,mi->mk", slopes.size, self.radius)
            e = Intervals(start.middle, (start.radius + spread) * WIDER)
            squared = self._squared(start, e, slopes)
            u = direction(e)
            T, excess = law.tension(squared), law.excess(squared)
            across = near(2.0) * law.bounds(squared, 1)[1]
            b = (u[:, :, np.newaxis] * slopes).sum(1)
            wide = (slice(None), np.newaxis, np.newaxis)
            bent = (u[:, :, np.newaxis, np.newaxis] * one.over[2]).sum(1)
            along = total(
                [
                    T[wide] * bent,
                    across[wide] * product(_transposed(slopes), slopes),
                    excess[wide] * products(b),
                ]
            )
            outer = u[:, :, np.newaxis] * b[:, np.newaxis, :]
            mixed = across[wide] * slopes + excess[wide] * outer
            found.append(_Parts(along, mixed, across, excess, u, squared))
        return found

    def _squared(self, start: Intervals, e: Intervals, slopes: Intervals) -> Intervals:
        """Return ℓ² over the boxes: its bounds by entries, and by its slopes 2e'e,i."""
        by_entries, at_centre = e.square().sum(1), start.square().sum(1)
        rates = (e[:, :, np.newaxis] * slopes).sum(1).size
        spread = 2 * np.einsum("mi,mi->m", rates, self.radius) * WIDER
        low = np.fmax(by_entries.low, at_centre.low - spread)
        high = np.fmin(by_entries.high, at_centre.high + spread)
        return between(np.nextafter(low, -np.inf), np.nextafter(high, np.inf))

    def _chosen(self, S: Array) -> tuple[Intervals, Array]:
        """Return C and B with B'HB near 1, both from the centres, to round-off."""
        bend, mixed = np.tile(S, (len(self.radius), 1, 1)), np.zeros((len(self.radius), 3, 3))
        for one, e in zip(self.offsets, self.e, strict=True):
            P = one.ligament.bend(e).middle
            bend += P
            mixed += P @ one.at_centre[1].middle
        usable = np.all(np.isfinite(bend), axis=(1, 2), keepdims=True)
        bend = np.where(usable, bend, S)
        C = -np.linalg.solve(bend, np.where(usable, mixed, 0.0))
        return exact(C), scaling(bend)


def _offset(ligament: FreeLigament, t: Array, boxes: Boxes) -> _Offset:
    found = [at_centres(form, t, boxes) for form in ligament.offset]
    over = [over_boxes(one, boxes.radius) for one in found]
    return _Offset(
        ligament,
        [stacked([one[order] for one in found]) for order in range(3)],
        [stacked([one[order] for one in over]) for order in range(3)],
    )


def _transposed(matrix: Intervals) -> Intervals:
    return Intervals(matrix.middle.swapaxes(1, 2), matrix.radius.swapaxes(1, 2))
