"""The energy of one ligament of a body that is not held, with its derivatives, in balls.

The length is ℓ = |e| with e = z + r(Θ). Over a box of Θ with centre m and δ = Θ - m, let
z = ẑ + Cδ + ζ. The six variables δ and ζ are numbered from 0 to 5. Derivatives of ℓ by them follow
from ℓ² = |e|²:

    ℓ ℓ_a = e'e_a        ℓ ℓ_ab = e_a'e_b + e'e_ab - ℓ_a ℓ_b

so that Φ has the second derivatives (Φ'/ℓ)(e_a'e_b + e'e_ab) + (Φ'' - Φ'/ℓ)ℓ_aℓ_b.
"""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from flint import arb

from rbstab.analysis.proof_check.boxes import AXES
from rbstab.analysis.proof_check.lengths.ligaments import LigamentLaw
from rbstab.analysis.proof_check.lengths.small_matrices import Rows
from rbstab.analysis.proof_check.trigonometric import (
    Axes,
    Ball,
    TrigonometricSum,
    axes_of,
    square,
)

SIX = range(6)


class FreeLigament:
    """A ligament: its law, and the entries of r.

    Args:
        data: The numbers of the law, and offset, the coefficients of the three entries of r, m.
    """

    def __init__(self, data: Mapping[str, Any]) -> None:
        self.law = LigamentLaw(data)
        self.offset = [TrigonometricSum(one) for one in data["offset"]]
        stiffness, length, toe = (data[key] for key in ("stiffness", "slack_length", "toe_strain"))
        self._doubles = (stiffness, length, toe)

    def pull(self, e: Sequence[float]) -> tuple[list[float], Rows]:
        """Return ∂Φ/∂e and ∂²Φ/∂e² in doubles."""
        k, slack, toe = self._doubles
        length = sum(one * one for one in e) ** 0.5
        strain = length / slack - 1
        if strain <= 0:
            return [0.0] * 3, [[0.0] * 3 for _ in AXES]
        inside = strain < 2 * toe
        tension = k * strain**2 / (4 * toe) if inside else k * (strain - toe)
        rate = k * (strain / (2 * toe) if inside else 1.0) / slack
        u = [one / length for one in e]
        across = tension / length
        rows = [[across * (i == j) + (rate - across) * u[i] * u[j] for j in AXES] for i in AXES]
        return [tension * one for one in u], rows


class Place(NamedTuple):
    """Where the body is over a box of Θ: z = ẑ + Cδ + ζ.

    Attributes:
        z: ẑ.
        C: The 3x3 matrix C.
        step: δ.
    """

    z: Sequence[Ball]
    C: Sequence[Sequence[Ball]]
    step: Sequence[Ball]


Offsets = list[tuple[Mapping[Axes, Ball], Mapping[Axes, Ball]]]
"""Each entry of r with its derivatives up to order 2: at the centre, and over the box."""


def offset_over(
    ligament: FreeLigament, centre: Sequence[Ball], whole: Sequence[Ball], step: Sequence[Ball]
) -> Offsets:
    """Return the offset of a ligament over the box of all Θ = centre + step, called whole."""
    found: Offsets = []
    for entry in ligament.offset:
        at_centre, over = entry.derivatives(centre), dict(entry.derivatives(whole))
        for axes in sorted(over, key=len, reverse=True):
            if len(axes) < 3:
                slopes = (over[axes_of(*axes, k)] * step[k] for k in AXES)
                sharper = sum(slopes, at_centre[axes])
                if sharper.rad() < over[axes].rad():
                    over[axes] = sharper
        found.append((at_centre, over))
    return found


class LigamentOver:
    """The energy Φ of one ligament with its derivatives by δ and ζ.

    Args:
        ligament: The ligament.
        r: Its offset.
        place: Where the body is.
        zeta: Balls of ζ.
        where: 0: at the centre; 1: over the box.
    """

    def __init__(
        self, ligament: FreeLigament, r: Offsets, place: Place, zeta: Sequence[Ball], where: int
    ) -> None:
        self.r, self.where = r, where
        step = place.step if where else [arb(0)] * 3
        start = [r[k][0][()] + place.z[k] + zeta[k] for k in AXES]
        by_angle = [[r[k][where][i,] + place.C[k][i] for k in AXES] for i in AXES]
        e = [start[k] + sum((by_angle[i][k] * step[i] for i in AXES), arb(0)) for k in AXES]
        # The slopes of e by δ and by ζ, and those of ℓ² divided by 2.
        self.rates = [*by_angle, *[[arb(int(k == m)) for k in AXES] for m in AXES]]
        half = [dot(e, by_angle[i]) for i in AXES]
        squared = sum((square(one) for one in e), arb(0))
        if where:
            by_slopes = sum((square(one) for one in start), arb(0))
            by_slopes += 2 * sum((half[i] * step[i] for i in AXES), arb(0))
            squared = squared.intersection(by_slopes)
        law = ligament.law
        self.slack = bool(squared < square(law.slack_length))
        self.slopes, self.turned, self.energy = [arb(0)] * 6, [arb(0)] * 3, arb(0)
        if self.slack:
            return
        # Where it is slack, all derivatives are 0; they are those at ℓ₀ too.
        length = squared.max(square(law.slack_length)).sqrt()
        self.energy, self.first, _, _ = law.derivatives(length)
        self.across, self.excess = law.across_and_excess(length)
        u = [_in_unit(one / length) for one in e]
        self.e = e
        along = [dot(u, by_angle[i]) for i in AXES]
        self.along = [*along, *u]
        self.slopes = [self.first * one for one in self.along]
        # ∂Φ/∂θ_i at constant z, which is the derivative at constant ζ where ∂W/∂ζ = 0.
        plain = [[r[k][where][i,] for k in AXES] for i in AXES]
        self.turned = [self.first * dot(u, plain[i]) for i in AXES]

    def bends(self) -> list[tuple[int, int, Ball]]:
        """Return the second derivatives of Φ with a >= b; none where it is slack."""
        if self.slack:
            return []
        found = []
        for a in SIX:
            for b in range(a + 1):
                outer = self.along[a] * self.along[b]
                half = dot(self.rates[a], self.rates[b])
                if a < 3:
                    bent = [self.r[k][self.where][axes_of(a, b)] for k in AXES]
                    half += dot(self.e, bent)
                found.append((a, b, self.across * half + self.excess * outer))
        return found


def dot(one: Sequence[Ball], other: Sequence[Ball]) -> Ball:
    """Return the scalar product of two vectors of three balls."""
    return one[0] * other[0] + one[1] * other[1] + one[2] * other[2]


def _in_unit(ball: Ball) -> Ball:
    """Return a ball within [-1, 1]; the number is known to lie there."""
    unit = arb(0, 1)
    return ball.intersection(unit) if ball.overlaps(unit) else unit
