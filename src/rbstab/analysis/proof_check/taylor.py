"""The Taylor expansion of a reduced energy over a box, in balls."""

import copy
import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

from flint import arb, arb_mat

from rbstab.analysis.proof_check.boxes import AXES, Box
from rbstab.analysis.proof_check.energy import Energy
from rbstab.analysis.proof_check.formulas.kinks import ANY_SHARE, Kink, KinkOver, Share
from rbstab.analysis.proof_check.guards import SwitchingGuard
from rbstab.analysis.proof_check.trigonometric import Axes, Ball, axes_of, square

SWEEPS = 4
"""So often each λ of several kinks is improved."""


def symmetric(radius: float) -> Ball:
    """Return the ball about 0 with a radius, rounded up."""
    return arb(0, math.nextafter(radius, math.inf))


def centre_and_step(
    box: Box, face: tuple[int, Ball] | None = None
) -> tuple[list[Ball], list[Ball]]:
    """Return the centre m of a box, and the balls of all Θ - m.

    Args:
        box: The box.
        face: An axis and its exact value, a ball. The box is then flat along this axis.
    """
    middle = [low / 2 + high / 2 for low, high in box]
    centre = [arb(point) for point in middle]
    step = [symmetric(max(b - m, m - a)) for m, (a, b) in zip(middle, box, strict=True)]
    if face is not None:
        axis, value = face
        centre[axis], step[axis] = value, arb(0)
    return centre, step


class Taylor:
    """U over a box, expanded about its centre m up to third order, with δ = Θ - m.

    With guards, bare is the expansion without them, and `added` has bounds on their energy and
    slopes over the box. The gradient has all slopes of a guard that jumps in the box; no number at
    a stop, without which `inside` is; `stopped` says on which sides it may act. With a jump, below
    is the expansion with a line in place of the energy of what jumps, nowhere above it.
    value, gradient (3x1) and hessian (3x3) are those at m. change is the 3x3 matrix Tδ, with the
    third derivatives T over the whole box. With free ligaments or formulas, the Hessian of their
    energy is that over the whole box. So, for all Θ in the box,

        U = value + gradient'δ + ½ δ'(hessian + Tδ/3)δ
        ∇U = gradient + (hessian + Tδ/2)δ               H = hessian + Tδ.

    If kinks of users may jump in the box, the gradient has all their slopes, and the Hessian over
    the box has no numbers. `jumping` are these kinks.

    Args:
        U: The energy.
        box: The box.
        face: As for `centre_and_step`.
        without: A guard or a kink to leave out.
        shares: λ of each kink, of which λh then takes the place; None for one to take it as it is,
            or for all of them.
    """

    def __init__(
        self,
        U: Energy,
        box: Box,
        face: tuple[int, Ball] | None = None,
        without: SwitchingGuard | Kink | None = None,
        shares: Sequence[float | None] | None = None,
    ) -> None:
        self._again = (U, box, face, without)
        centre, step = centre_and_step(box, face)
        whole = [point + ball for point, ball in zip(centre, step, strict=True)]
        self.free = [axis for axis in AXES if face is None or axis != face[0]]
        self.centre, self.step = centre, arb_mat([[entry] for entry in step])
        at_centre, third = U.smooth(centre), U.smooth(whole)
        kinks = [KinkOver(one, centre, step) for one in U.kinks if one is not without]
        self.kinks, self.shares = kinks, shares or [None] * len(kinks)
        pairs = list(zip(kinks, self.shares, strict=True))
        self.jumping = [one for one, share in pairs if share is None and one.jumps]
        self.parts = U.parts_over(centre, step)
        self.parts += [one if t is None else Share(one.argument, t) for one, t in pairs]
        self._expand(at_centre, third)
        self.bare: Taylor | None = None
        self.below: Taylor | None = None
        self.inside: Taylor | None = None
        guards = [one for one in U.guards if one is not without]
        if not U.barriers and not guards:
            return
        self.bare, self.added = copy.copy(self), (arb(0), [arb(0)] * 3)
        for barrier in U.barriers:
            energy, slope, *_ = barrier.terms(whole[barrier.axis])
            self._enlarge(energy, slope, barrier.axis)
        if U.barriers:
            at_centre = U.with_barriers(at_centre, centre)
            self._expand(at_centre, U.with_barriers(third, whole))
        jumping = [one for one in guards if one.jumps(whole[1])]
        for one in guards:
            if one not in jumping:
                self._add(one, whole[1], centre[1])
        if jumping:
            self.below = copy.copy(self)
            self.below.gradient, self.below.bare = arb_mat(self.gradient), None
            for one in jumping:
                self.below._add_line(one, whole[1])
                self._add(one, whole[1], centre[1])

    def _expand(self, at_centre: Mapping[Axes, Ball], third: Mapping[Axes, Ball]) -> None:
        """Set the terms of the expansion."""
        step = self.step.entries()
        self.value = at_centre[()]
        self.gradient = arb_mat([[at_centre[i,]] for i in AXES])
        self.hessian = arb_mat([[at_centre[min(i, j), max(i, j)] for j in AXES] for i in AXES])
        self.change = arb_mat(
            [
                [sum((third[axes_of(i, j, k)] * step[k] for k in AXES), arb(0)) for j in AXES]
                for i in AXES
            ]
        )
        for part in self.parts:
            self.value += part.value
            self.gradient += arb_mat([[entry] for entry in part.gradient])
            self.hessian += part.hessian

    def _add(self, guard: SwitchingGuard, whole: Ball, centre: Ball) -> None:
        """Add a guard for a ball of θ2 and its centre."""
        self.value += guard.energy(centre)
        if guard.couple is None:
            # A stop: any slope outwards from 0 on. Inside it adds nothing.
            if guard.touched(whole):
                self.inside = copy.copy(self)
                self.stopped = tuple(whole.overlaps(side * guard.angle) for side in (-1, 1))
                self._raise(arb("nan"), arb(0))
                self._enlarge(arb(0), arb("nan"))
            return
        slope = guard.slope(whole if guard.jumps(whole) else centre)
        self._raise(slope, guard.curvature(whole))
        self._enlarge(guard.energy(whole), guard.slope(whole))

    def _enlarge(self, energy: Ball, slope: Ball, axis: int = 1) -> None:
        """Add to the bounds on the energy and the slopes of the guards over the box."""
        slopes = list(self.added[1])
        slopes[axis] += slope
        self.added = (self.added[0] + energy, slopes)

    def _add_line(self, guard: SwitchingGuard, whole: Ball) -> None:
        """Add a line through the angle of a guard that is nowhere above its energy.

        Its slope is one of those at the angle, and balances that of all else if it can.
        """
        side = 1 if whole > 0 else -1 if whole < 0 else 0
        pressing = (-side * self.gradient[1, 0]).mid()
        if side == 0 or not pressing > 0:
            return
        if guard.couple is not None and not pressing < guard.couple:
            pressing = arb(guard.couple.lower())
        self.value += pressing * (side * self.centre[1] - guard.angle)
        self._raise(side * pressing, arb(0))

    def _raise(self, slope: Ball, curvature: Ball) -> None:
        """Add to the derivatives of order 1 and 2 by θ2."""
        gradient, hessian = arb_mat(self.gradient), arb_mat(self.hessian)
        gradient[1, 0] += slope
        hessian[1, 1] += curvature
        self.gradient, self.hessian = gradient, hessian

    @property
    def whole_hessian(self) -> Any:
        """The Hessian over the box; no numbers where the slope of a guard or a kink jumps in it."""
        found = self.hessian + self.change
        if self.jumping:
            return arb_mat([[arb("nan") for _ in AXES] for _ in AXES])
        if self.below is not None:
            found[1, 1] = arb("nan")
        return found

    @property
    def whole_gradient(self) -> Any:
        """The gradient over the box."""
        found = self.gradient + self.slope * self.step
        if self.bare is not None:
            bare = self.bare.whole_gradient
            for axis in AXES:
                along = bare[axis, 0] + self.added[1][axis]
                found[axis, 0] = found[axis, 0] if along.contains(0) else along
        if self.inside is not None:
            # A stop pushes inwards: it balances nothing that does so too.
            rest = self.inside.whole_gradient[1, 0]
            excluded = (rest > 0 and not self.stopped[0]) or (rest < 0 and not self.stopped[1])
            found[1, 0] = rest if excluded else arb("nan")
        return found

    @property
    def slope(self) -> Any:
        """The matrix S with ∇U = gradient + Sδ over the box."""
        return self.hessian + self.change / 2

    @property
    def inverse(self) -> Any:
        """A matrix Y near the inverse of the Hessian at m; None if there is none."""
        try:
            inverse = self.hessian.mid().inv().mid()
        except ZeroDivisionError:
            return None
        return inverse if all(entry.is_finite() for entry in inverse.entries()) else None

    def stays_above(self, bound: Ball) -> bool:
        """Return whether U >= bound is proved for all of the box."""
        if bool(self.values >= bound) or bool(self._by_squares() >= bound):
            return True
        if self.below is not None and self.below.stays_above(bound):
            return True
        return self.below_valleys is not None and self.below_valleys.stays_above(bound)

    def wall(self, bound: Ball) -> int | None:
        """Return a ridge in the box on which U >= bound is proved, by its number among the ridges.

        None without one. Where h = 0, U is the same with λh in the place of min(h, 0).
        """
        ridges = [place for place, one in enumerate(self.kinks) if one.kink.ridge]
        for number, place in enumerate(ridges):
            if not self.kinks[place].jumps:
                continue
            on_ridge = list(self._shares_below)
            on_ridge[place] = self._flattest[place]
            if Taylor(*self._again, on_ridge).stays_above(bound):
                return number
        return None

    @cached_property
    def flat(self) -> "Taylor":
        """The expansion with λh in place of each kink."""
        return Taylor(*self._again, self._flattest)

    @property
    def _shares_below(self) -> list[float | None]:
        """λ of each kink, but for the ridges that may jump: λh is above them."""
        open_ridges = [one for one in self.jumping if one.kink.ridge]
        pairs = zip(self.kinks, self._flattest, strict=True)
        return [None if one in open_ridges else share for one, share in pairs]

    @cached_property
    def below_valleys(self) -> "Taylor | None":
        """The expansion with λh in place of each max(h, 0), nowhere above U.

        None if no max(h, 0) may jump.
        """
        if all(one.kink.ridge for one in self.jumping):
            return None
        return Taylor(*self._again, self._shares_below)

    @cached_property
    def _flattest(self) -> list[float]:
        """λ of each kink for which `flat` is as flat as it can be; any would do."""
        radius = [self.step[i, 0].abs_upper() for i in AXES]

        def change(entries: Sequence[Ball]) -> list[Ball]:
            """Return the changes over the box that belong to slopes."""
            return [entry.mid() * r for entry, r in zip(entries, radius, strict=True)]

        left = change(self.gradient.entries())
        # The gradient has the middle of all slopes of those that may jump.
        for one in self.jumping:
            inner = change([ANY_SHARE.mid() * entry for entry in one.argument.slopes])
            left = [x - y for x, y in zip(left, inner, strict=True)]
        # Where one does not jump, λ is known; and it may be given.
        pairs = list(zip(self.kinks, self.shares, strict=True))
        found = [float(one.acts) if share is None else share for one, share in pairs]
        places = [place for place, one in enumerate(self.kinks) if one in self.jumping]
        for place in places * (SWEEPS if len(places) > 1 else 1):
            step = change(self.kinks[place].argument.gradient)
            square = sum((x * x for x in step), arb(0))
            along = sum((x * y for x, y in zip(left, step, strict=True)), arb(0))
            best = found[place] - (float(along / square) if square > 0 else 0.0)
            share = min(1.0, max(0.0, best)) if math.isfinite(best) else 0.0
            left = [x + (share - found[place]) * y for x, y in zip(left, step, strict=True)]
            found[place] = share
        return found

    @property
    def excludes_jumps(self) -> bool:
        """Whether for no λ all slopes of U are zero, in a box with jumps.

        With the gradient g of `flat`, all slopes are g + Σ t_k ∇h_k, where λ_k + t_k is
        between 0 and 1. If they are zero, n'(g + Σ t_j ∇h_j) = 0 with n near ∇h_k bounds t_k. They
        are not if a t_k has no value left, or if d'(g + Σ t_k ∇h_k) > 0 with d = g at the centre.
        """
        if not self.jumping:
            return False
        pairs = zip(self.kinks, self._flattest, strict=True)
        room = {one: ANY_SHARE - arb(share) for one, share in pairs if one in self.jumping}
        for one in self.jumping:
            normal = [entry.mid() for entry in one.argument.gradient]
            steepness = _dot(normal, one.argument.slopes)
            if not steepness > 0:
                continue
            others = {other: t for other, t in room.items() if other is not one}
            needed = -self._slopes_along(normal, others) / steepness
            if not needed.is_finite():
                continue
            if not needed.overlaps(room[one]):
                return True
            room[one] = room[one].intersection(needed)
        d = [entry.mid() for entry in self.flat.gradient.entries()]
        return bool(self._slopes_along(d, room) > 0)

    def _slopes_along(self, direction: Sequence[Ball], room: Mapping[KinkOver, Ball]) -> Ball:
        """Return the products of a direction with all g + Σ t_k ∇h_k over the box."""
        flat, d = self.flat, arb_mat([[*direction]])
        found = (d * flat.gradient)[0, 0] + ((d * flat.slope) * flat.step)[0, 0]
        return found + sum(
            (t * _dot(direction, one.argument.slopes) for one, t in room.items()), arb(0)
        )

    @property
    def values(self) -> Ball:
        """A ball with all values of U over the box: the sum of its terms, with δ_i² >= 0."""
        total = self._sum_of_terms()
        if self.bare is None:
            return total
        apart = self.bare.values + self.added[0]
        return total if total.rad() < apart.rad() else apart

    def _sum_of_terms(self) -> Ball:
        d, bent = self.step, self.hessian + self.change / 3
        total = self.value
        for i in AXES:
            total += self.gradient[i, 0] * d[i, 0]
            total += bent[i, i] * square(d[i, 0].abs_upper()) * arb(0.25, 0.25)
            total += sum((bent[i, j] * d[i, 0] * d[j, 0] for j in range(i + 1, 3)), arb(0))
        return total

    def _by_squares(self) -> Ball:
        """Bound U by its unbounded minimum: gradient'δ + ½ δ'Hδ >= -½ gradient'H⁻¹gradient."""
        H = arb_mat([[self.hessian[i, j] for j in self.free] for i in self.free])
        g = arb_mat([[self.gradient[i, 0]] for i in self.free])
        size = len(self.free)
        leading = (arb_mat([[H[i, j] for j in range(n)] for i in range(n)]) for n in range(1, size))
        if not all(minor.det() > 0 for minor in [*leading, H]):
            return arb("nan")
        try:
            fall = g.transpose() * H.inv() * g / 2
        except ZeroDivisionError:
            return arb("nan")
        cubic = self.step.transpose() * self.change * self.step / 6
        return self.value - fall[0, 0] + cubic[0, 0]


def _dot(a: Sequence[Ball], b: Sequence[Ball]) -> Ball:
    return sum((x * y for x, y in zip(a, b, strict=True)), arb(0))
