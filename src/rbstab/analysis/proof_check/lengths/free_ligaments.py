"""The least energy V(Θ) of ligaments over the position of a body, in balls.

    V(Θ) = min over z of W,    W = ½ z'Sz + Σ Φ_j(ℓ_j),    ℓ_j² = |z + r_j(Θ)|²

Over a box of Θ with centre m and δ = Θ - m, let z = ẑ + Cδ + ζ, as in `free_ligament.py`. With the
blocks P, Q and H of the second derivatives of W (δδ, δζ and ζζ), V has the Hessian P - Q H⁻¹ Q'
where ∂W/∂ζ = 0. ẑ, C and the matrix B below are computed in doubles: all that is concluded holds
for any of them.
"""

from collections.abc import Mapping, Sequence
from typing import Any

from flint import arb, arb_mat

from rbstab.analysis.proof_check.boxes import AXES
from rbstab.analysis.proof_check.lengths.free_ligament import (
    SIX,
    FreeLigament,
    LigamentOver,
    Place,
    dot,
    offset_over,
)
from rbstab.analysis.proof_check.lengths.small_matrices import (
    Rows,
    inverse,
    product,
    scaling,
)
from rbstab.analysis.proof_check.lowest_point import lowest_point, norm
from rbstab.analysis.proof_check.trigonometric import (
    Ball,
    rounded,
    square,
)

NEWTON_STEPS = 60

ROOM = 2
"""The bound that is tried for ζ is so many times what is expected of it."""


class FreeLigaments:
    """V and its derivatives up to order 2.

    Args:
        data: `free_ligaments` of the energy of a proof.

    Raises:
        ValueError: S is not symmetric and positive definite, or a number of a ligament is wrong.
    """

    def __init__(self, data: Mapping[str, Any]) -> None:
        S = data["stiffness"]
        if any(S[i][j] != S[j][i] for i in AXES for j in AXES):
            raise ValueError("The stiffness of z is not symmetric")
        self.stiffness = [[rounded(entry) for entry in row] for row in S]
        minors = (arb_mat([row[:n] for row in self.stiffness[:n]]) for n in (1, 2, 3))
        if not all(minor.det() > 0 for minor in minors):
            raise ValueError("The stiffness of z is not positive definite")
        self.doubles: Rows = [[float(entry) for entry in row] for row in S]
        self.ligaments = [FreeLigament(one) for one in data["ligaments"]]

    @property
    def cost(self) -> int:
        """The number of evaluations of U that take as long as V over a box."""
        return 4 * len(self.ligaments)

    def largest(self) -> Ball:
        """A bound on V at any Θ: the energies of all ligaments at z = 0."""
        wide = [arb(0, 4)] * 3
        found = arb(0)
        for one in self.ligaments:
            r = [entry.derivatives(wide)[()] for entry in one.offset]
            longest = sum((square(entry) for entry in r), arb(0)).abs_upper().sqrt()
            found += one.law.derivatives(longest)[0].abs_upper()
        return found

    def steepest(self, axis: int) -> Ball:
        """Bound |∂V/∂θ| along an axis: T² <= 2 (k/ℓ₀) V, as T grows at most with k/ℓ₀."""
        total, most = arb(0), self.largest()
        for one in self.ligaments:
            squares = (square(entry.steepest(axis)) for entry in one.offset)
            turned_by = sum(squares, arb(0)).abs_upper().sqrt()
            tension = (2 * one.law.k / one.law.slack_length * most).abs_upper().sqrt()
            total += tension * turned_by
        return total

    def energy_at(self, Theta: Sequence[Ball], z: Sequence[Ball]) -> Ball:
        """Return ½ z'Sz + Σ Φ_j at any z."""
        found = dot([dot(row, z) for row in self.stiffness], z) / 2
        for ligament in self.ligaments:
            r = [entry.derivatives(Theta)[()] for entry in ligament.offset]
            e = [one + other for one, other in zip(r, z, strict=True)]
            found += ligament.law.derivatives(dot(e, e).sqrt())[0]
        return found

    def over(self, centre: Sequence[Ball], step: Sequence[Ball]) -> "Over":
        """Return V over the box of all Θ = centre + step."""
        return Over(self, centre, step)

    def shift(self, r: Sequence[Sequence[float]]) -> tuple[list[float], Rows]:
        """Return z near the least W, and ∂²W/∂z² there, in doubles, by Newton's method.

        Args:
            r: The offset of each ligament.
        """
        z, slope, bend = [0.0] * 3, *self._derivatives(r, [0.0] * 3)
        size = sum(one * one for one in slope)
        for _ in range(NEWTON_STEPS):
            step = [-sum(a * b for a, b in zip(row, slope, strict=True)) for row in inverse(bend)]
            share = 1.0
            while share > 1e-6:
                moved = [a + share * b for a, b in zip(z, step, strict=True)]
                found = self._derivatives(r, moved)
                smaller = sum(one * one for one in found[0])
                if smaller <= size:
                    break
                share /= 2
            else:
                break
            done = max(map(abs, step)) < 1e-15 * (1e-3 + max(map(abs, moved)))
            z, (slope, bend), size = moved, found, smaller
            if done:
                break
        return z, bend

    def _derivatives(
        self, r: Sequence[Sequence[float]], z: Sequence[float]
    ) -> tuple[list[float], Rows]:
        slope = [sum(a * b for a, b in zip(row, z, strict=True)) for row in self.doubles]
        bend = [list(row) for row in self.doubles]
        for one, offset in zip(self.ligaments, r, strict=True):
            pull, rows = one.pull([a + b for a, b in zip(z, offset, strict=True)])
            slope = [a + b for a, b in zip(slope, pull, strict=True)]
            bend = [[bend[i][j] + rows[i][j] for j in AXES] for i in AXES]
        return slope, bend


class Over:
    """V over a box of Θ.

    Attributes:
        value: V at the centre.
        gradient: Its three derivatives there.
        hessian: The 3x3 matrix of its second derivatives, over the box.
    """

    def __init__(self, V: FreeLigaments, centre: Sequence[Ball], step: Sequence[Ball]) -> None:
        self.V = V
        whole = [point + ball for point, ball in zip(centre, step, strict=True)]
        self.r = [offset_over(one, centre, whole, step) for one in V.ligaments]
        middle = [[float(entry[0][()].mid()) for entry in r] for r in self.r]
        z, bend = V.shift(middle)
        C, self.B = self._chosen(z, bend)
        self.place = Place([arb(one) for one in z], C, step)
        pairs = list(zip(V.ligaments, self.r, strict=True))
        at_centre = [LigamentOver(one, r, self.place, [arb(0)] * 3, 0) for one, r in pairs]
        pulled = [dot(row, self.place.z) for row in V.stiffness]
        self.slope = [
            pulled[k] + sum((line.slopes[3 + k] for line in at_centre), arb(0)) for k in AXES
        ]
        # By strong convexity with S: |ζ| <= |B'g| in the norm of S, B'SB = 1.
        self.soft = scaling(V.doubles)
        self.soft_least = _least(self.soft, V.stiffness)
        size = norm(self._lengths(self.soft, self.slope)) / self.soft_least
        near = self._in_ball(self.soft, size)
        about = [LigamentOver(one, r, self.place, near, 0) for one, r in pairs]
        stored = sum((a * b for a, b in zip(pulled, self.place.z, strict=True)), arb(0)) / 2
        value = stored + sum((line.energy for line in at_centre), arb(0))
        self.value = value + arb(0).union(-(size * size / 2).abs_upper())
        self.gradient = [sum((line.turned[i] for line in about), arb(0)) for i in AXES]
        self.hessian = self._hessian()

    def _hessian(self) -> Any:
        """Return the Hessian over the box."""
        rows = self._second([arb(0)] * 3)
        found = self._near(rows)
        if found is None:
            B, least = self.soft, self.soft_least
            widths = self._in_ball(B, norm(self._loads(B, rows)) / least)
        else:
            B, least, widths = found
        rows = self._second(widths)
        BQ = [[sum((B[k][m] * rows[3 + k][i] for k in AXES), arb(0)) for i in AXES] for m in AXES]
        sizes = [
            (sum((square(BQ[m][i].abs_upper()) for m in AXES), arb(0)) / least).abs_upper().sqrt()
            for i in AXES
        ]
        return arb_mat(
            [
                [rows[i][j] + arb(0, 1) * (sizes[i] * sizes[j]).abs_upper() for j in AXES]
                for i in AXES
            ]
        )

    def _near(self, rows: Sequence[Sequence[Ball]]) -> tuple[Rows, Ball, list[Ball]] | None:
        """Return B, λ and bounds on |ζ_k|, with B'HB near 1 at the centre; None if not proved."""
        B = self.B

        def bend(sizes: Sequence[Ball]) -> list[list[Ball]]:
            second = self._second(self._widths(B, sizes))
            H = [[second[3 + i][3 + j] for j in AXES] for i in AXES]
            HB = [[sum((H[i][k] * B[k][j] for k in AXES), arb(0)) for j in AXES] for i in AXES]
            return [[sum((B[k][i] * HB[k][j] for k in AXES), arb(0)) for j in AXES] for i in AXES]

        found = lowest_point(self._loads(B, rows), ROOM, bend)
        return None if found is None else (B, found[1], self._widths(B, found[0]))

    def _loads(self, B: Rows, rows: Sequence[Sequence[Ball]]) -> list[Ball]:
        """Bound the entries of B'g over the box, where g is ∂W/∂ζ at ζ = 0."""
        found = []
        for m in AXES:
            total = sum((B[k][m] * self.slope[k] for k in AXES), arb(0))
            for i in AXES:
                rate = sum((B[k][m] * rows[3 + k][i] for k in AXES), arb(0))
                total += rate * self.place.step[i]
            found.append(total.abs_upper())
        return found

    def _lengths(self, B: Rows, g: Sequence[Ball]) -> list[Ball]:
        """Return the entries of B'g."""
        return [sum((B[k][m] * g[k] for k in AXES), arb(0)).abs_upper() for m in AXES]

    def _widths(self, B: Rows, sizes: Sequence[Ball]) -> list[Ball]:
        """Return balls with all entries of ζ = Bξ, |ξ_k| <= sizes_k."""
        rows = (sum((abs(arb(B[k][m])) * sizes[m] for m in AXES), arb(0)) for k in AXES)
        return [arb(0, 1) * row.abs_upper() for row in rows]

    def _in_ball(self, B: Rows, size: Ball) -> list[Ball]:
        """Return balls with all entries of ζ = Bξ, |ξ| <= size."""
        rows = (norm([arb(B[k][m]) for m in AXES]) * size for k in AXES)
        return [arb(0, 1) * row.abs_upper() for row in rows]

    def _second(self, zeta: Sequence[Ball]) -> list[list[Ball]]:
        """Return the second derivatives of W over the box, with ζ in balls: a 6x6 matrix."""
        S, C = self.V.stiffness, self.place.C
        SC = [[sum((S[k][m] * C[m][i] for m in AXES), arb(0)) for i in AXES] for k in AXES]
        rows = [[arb(0)] * 6 for _ in SIX]
        for i in AXES:
            for j in AXES:
                rows[i][j] = sum((C[k][i] * SC[k][j] for k in AXES), arb(0))
                rows[3 + i][3 + j] = S[i][j]
                rows[3 + i][j] = SC[i][j]
                rows[j][3 + i] = SC[i][j]
        for one, r in zip(self.V.ligaments, self.r, strict=True):
            line = LigamentOver(one, r, self.place, zeta, 1)
            for a, b, bend in line.bends():
                rows[a][b] += bend
                if a != b:
                    rows[b][a] += bend
        return rows

    def _chosen(self, z: Sequence[float], bend: Rows) -> tuple[list[list[Ball]], Rows]:
        """Return C, near ∂z/∂Θ at the centre, and B with B'HB near 1 there."""
        mixed = [[0.0] * 3 for _ in AXES]
        for one, r in zip(self.V.ligaments, self.r, strict=True):
            e = [float(entry[0][()].mid()) + z[k] for k, entry in enumerate(r)]
            _, rows = one.pull(e)
            slopes = [[float(entry[0][i,].mid()) for i in AXES] for entry in r]
            more = product(rows, slopes)
            mixed = [[mixed[i][j] + more[i][j] for j in AXES] for i in AXES]
        C = product(inverse(bend), mixed)
        return [[arb(-one) for one in row] for row in C], scaling(bend)


def _least(B: Rows, S: Sequence[Sequence[Ball]]) -> Ball:
    """Return a lower bound of the eigenvalues of B'SB, which is 1 to round-off; else no number."""
    most = arb(0)
    for i in AXES:
        total = arb(0)
        for j in AXES:
            entry = sum((B[k][i] * S[k][m] * B[m][j] for k in AXES for m in AXES), arb(0))
            total += abs(entry - int(i == j)).abs_upper()
        most = most.max(total)
    least = (1 - most).lower()
    return arb(least) if least > 0 else arb("nan")
