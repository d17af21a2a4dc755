"""The least energy of an element of a user over its own states D, in balls.

    V(Θ) = min over D of f(Θ, D)

f is convex in D by its form. Over a box with the centre m and δ = Θ - m, let D = D̂ + Cδ + Bξ; the
variables 0 to 2 are δ, and those from 3 on ξ. With the blocks P, Q and H of the second derivatives
of f by them (δδ, ξδ and ξξ), V has the slopes f_δ, and the Hessian P - Q'H⁻¹Q, where f_ξ = 0. D̂, C
and B are computed in doubles, so that H is near 1: all that is concluded holds for any regular B.
"""

from collections.abc import Mapping, Sequence
from math import isfinite
from typing import Any

from flint import arb, arb_mat

from rbstab.analysis.proof_check.boxes import AXES
from rbstab.analysis.proof_check.formulas import series
from rbstab.analysis.proof_check.formulas.convexity import is_convex
from rbstab.analysis.proof_check.formulas.formula import (
    bounds_over_parts,
    computed,
    is_periodic,
    operations_of,
    parts_fixed,
)
from rbstab.analysis.proof_check.formulas.series import Series
from rbstab.analysis.proof_check.lengths.small_matrices import Rows, product, scaling, turned
from rbstab.analysis.proof_check.lowest_point import lowest_point, norm
from rbstab.analysis.proof_check.trigonometric import Ball

MOST_STATES = 6

NEWTON_STEPS = 60

CONVERGED = 1e-9
"""A step that is so short, relative to D, is the last."""

ROOMS = (2, 8)
"""The bounds that are tried for ξ are so many times what is expected of it."""

LEAST_SHARE = 1e-6
"""Newton's steps are halved down to this share."""


class OwnStates:
    """V(Θ) of an element of a user.

    Args:
        data: Its name, the number of own states, and the operations of f.

    Raises:
        ValueError: They are no formula, or f is not shown to be convex in D, or it switches where
            a function of D does.
    """

    def __init__(self, data: Mapping[str, Any]) -> None:
        self.name, self.count = data["name"], int(data["states"])
        if not 0 < self.count <= MOST_STATES:
            raise ValueError(f"An energy has none, or more than {MOST_STATES} own states")
        self.operations = operations_of(data, {"theta": 3, "length": self.count})
        if not is_convex(self.operations):
            raise ValueError("A formula is not shown to be convex in its own states")
        self.fixed = parts_fixed(self.operations)
        self.arguments = [one[1] for one in self.operations if one[0] == "square_above"]
        if not self.fixed.issuperset(self.arguments):
            # Then f_D might have no derivatives along D, as lemma 17 needs.
            raise ValueError("A formula has a switch that depends on own states")
        self.begin = [0.0] * self.count
        self._steepest: list[Ball] | None = None

    @property
    def cost(self) -> int:
        """How many evaluations of an energy of sines and cosines take as long."""
        return 2 + len(self.operations) // 6

    @property
    def periodic(self) -> bool:
        """Whether θ1 and θ3 are used in sines and cosines alone, so that whole turns do nothing."""
        return is_periodic(self.operations)

    def value(self, Theta: Sequence[Ball]) -> Ball:
        """Return V at a ball of Θ."""
        return self._over(Theta).values

    def _over(self, Theta: Sequence[Ball]) -> "Over":
        """Return V over a ball of Θ."""
        middle = [angle.mid() for angle in Theta]
        return self.over(middle, [one - point for one, point in zip(Theta, middle, strict=True)])

    def near_lowest(self, Theta: Sequence[Ball]) -> list[Ball] | None:
        """Return D near the lowest point at a point; None where no bound on V is found."""
        over = self.over(Theta, [arb(0)] * 3)
        return [arb(one) for one in over.own] if over.value.is_finite() else None

    def stored(self, Theta: Sequence[Ball], D: Sequence[Ball]) -> Ball:
        """Return f."""
        return self._values(Theta, D)[-1]

    def switches(self, Theta: Sequence[Ball]) -> list[Ball]:
        """Return at a point what changes its sign where the formula switches."""
        found = self._values(Theta, [arb(0)] * self.count)
        return [found[place] for place in self.arguments]

    def _values(self, Theta: Sequence[Ball], D: Sequence[Ball]) -> list[Ball]:
        """Return the values of all operations."""
        values = {"theta": Theta, "length": D}
        found = computed(self.operations, lambda kind, k: {series.ZERO: values[kind][k]})
        return [one[series.ZERO] for one in found]

    def over(self, centre: Sequence[Ball], step: Sequence[Ball]) -> "Over":
        """Return V over the box of all Θ = centre + step."""
        return Over(self, centre, step)

    def steepest(self, axis: int) -> Ball:
        """Bound the derivative along an axis for |θ2| <= π/2, and |θ1| and |θ3| <= π."""
        if self._steepest is None:
            self._steepest = bounds_over_parts(lambda box: self._over(box).slopes)
        return self._steepest[axis]


class Over:
    """V over a box of Θ; no numbers where nothing bounds ξ.

    Attributes:
        value: V at the centre.
        gradient: Its three derivatives there.
        hessian: The 3x3 matrix of its second derivatives, over the box.
        values: V over the box.
        slopes: Its derivatives over the box.
    """

    def __init__(self, V: OwnStates, centre: Sequence[Ball], step: Sequence[Ball]) -> None:
        self.V, self.centre, self.step = V, centre, step
        self.places = range(3, 3 + V.count)
        none = [arb(0)] * 3
        nothing = (arb("nan"), [arb("nan")] * 3, arb_mat([[arb("nan")] * 3 for _ in AXES]))
        self.value, self.gradient, self.hessian = nothing
        self.values, self.slopes = nothing[:2]
        self.own = [0.0] * V.count
        at_centre = self._fixed(none)
        chosen = self._lowest(at_centre)
        if chosen is None:
            return
        self.own, self.C, self.B = chosen
        self.about = self._results(none, [arb(0)] * V.count, at_centre)
        whole = self._fixed(step, self.about)
        around = self._results(step, [arb(0)] * V.count, whole, self.about)[-1]
        loads = self._loads(around)
        for room in ROOMS:
            found = lowest_point(loads, room, lambda sizes: self._bend(self._at(sizes, whole)))
            if found is not None:
                self._set(*found, at_centre, whole)
                return

    def _set(
        self,
        sizes: Sequence[Ball],
        least: Ball,
        at_centre: Mapping[int, Series],
        whole: Mapping[int, Series],
    ) -> None:
        """Set the bounds on V, with |ξ_k| <= sizes_k over the box, and H >= least."""
        of_centre = self.about[-1]
        size = norm(self._loads(of_centre)) / least
        near = self._results([arb(0)] * 3, [_symmetric(size)] * self.V.count, at_centre)[-1]
        self.value = of_centre[series.ZERO] + arb(0).union(-(size * size * least / 2).abs_upper())
        self.gradient = [series.slope(near, i) for i in AXES]
        over = self._at(sizes, whole)
        self.values = over[series.ZERO]
        self.slopes = [series.slope(over, i) for i in AXES]
        lost = [norm([series.curvature(over, k, i) for k in self.places]) for i in AXES]
        self.hessian = arb_mat(
            [
                [
                    series.curvature(over, i, j)
                    + arb(0, 1) * (lost[i] * lost[j] / least).abs_upper()
                    for j in AXES
                ]
                for i in AXES
            ]
        )

    def _lowest(self, fixed: Mapping[int, Series]) -> tuple[list[float], Rows, Rows] | None:
        """Return D near the lowest point at the centre, C and B with B'HB near 1, in doubles."""
        # Of a near box, the last D is near.
        D = self.V.begin
        slope, bend, mixed = self._derivatives(D, fixed)
        for _ in range(NEWTON_STEPS):
            if not all(isfinite(one) for row in (slope, *bend) for one in row):
                self.V.begin = [0.0] * self.V.count
                return None
            step = [-one for (one,) in _solved(bend, [[one] for one in slope])]
            share, before = 1.0, max(map(abs, slope))
            while share > LEAST_SHARE:
                moved = [a + share * b for a, b in zip(D, step, strict=True)]
                tried = self._derivatives(moved, fixed)
                if max(map(abs, tried[0])) < before:
                    break
                share /= 2
            else:
                break
            short = max(map(abs, step)) < CONVERGED * (max(map(abs, D)) + max(map(abs, moved)))
            D, (slope, bend, mixed) = moved, tried
            if short:
                break
        self.V.begin = D
        return D, [[-one for one in row] for row in _solved(bend, mixed)], scaling(bend)

    def _derivatives(
        self, D: Sequence[float], fixed: Mapping[int, Series]
    ) -> tuple[list[float], Rows, Rows]:
        """Return f_D, f_DD and f_DΘ at the centre, in doubles."""

        def leaf(_: str, place: int) -> Series:
            return series.variable(arb(D[place]), 3 + place)

        f = computed(self.V.operations, leaf, known=fixed)[-1]
        slope = [float(series.slope(f, k).mid()) for k in self.places]
        rows = [[float(series.curvature(f, k, j).mid()) for j in self.places] for k in self.places]
        mixed = [[float(series.curvature(f, k, i).mid()) for i in AXES] for k in self.places]
        return slope, rows, mixed

    def _fixed(self, step: Sequence[Ball], about: Sequence[Series] = ()) -> dict[int, Series]:
        """Return the results that depend on Θ alone, for all Θ = centre + step."""
        fixed = self.V.fixed
        Theta = [point + ball for point, ball in zip(self.centre, step, strict=True)]
        wider = (*step, *[arb(0)] * self.V.count)

        def leaf(_: str, axis: int) -> Series:
            return series.variable(Theta[axis], axis)

        others = set(range(len(self.V.operations))) - fixed
        known: dict[int, Series] = {place: {} for place in others}  # no other one needs them
        found = computed(self.V.operations, leaf, about, wider if about else (), known)
        return {place: found[place] for place in fixed}

    def _results(
        self,
        step: Sequence[Ball],
        xi: Sequence[Ball],
        fixed: Mapping[int, Series],
        about: Sequence[Series] = (),
    ) -> list[Series]:
        """Return all results for δ in balls and ξ in balls."""
        wider = (*step, *xi)

        def leaf(_: str, k: int) -> Series:
            along = [arb(one) for one in (*self.C[k], *self.B[k])]
            moved = sum((one * ball for one, ball in zip(along, wider, strict=True)), arb(0))
            found: Series = {series.ZERO: arb(self.own[k]) + moved}
            return found | {(place,): one for place, one in enumerate(along)}

        return computed(self.V.operations, leaf, about, wider if about else (), fixed)

    def _at(self, sizes: Sequence[Ball], whole: Mapping[int, Series]) -> Series:
        """Return f over the box, for all |ξ_k| <= sizes_k."""
        return self._results(self.step, list(map(_symmetric, sizes)), whole, self.about)[-1]

    def _bend(self, f: Series) -> list[list[Ball]]:
        """Return H."""
        return [[series.curvature(f, i, j) for j in self.places] for i in self.places]

    def _loads(self, f: Series) -> list[Ball]:
        """Bound the entries of f_ξ."""
        return [series.slope(f, place).abs_upper() for place in self.places]


def _symmetric(size: Ball) -> Ball:
    """Return a ball with all numbers of at most a size."""
    return arb(0, 1) * size.abs_upper()


def _solved(A: Rows, right: Rows) -> Rows:
    """Return A⁻¹b = BB'b in doubles, for a positive definite A."""
    B = scaling(A)
    return product(B, product(turned(B), right))
