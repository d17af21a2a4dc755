"""A rest state at which a force that jumps holds the body, or from which it pushes away."""

from collections.abc import Mapping
from functools import cached_property
from typing import Any

from flint import arb, fmpq

from rbstab.proof.check.bounds import Bounds, centre_and_steps, misses_zero
from rbstab.proof.check.energy import Energy
from rbstab.proof.check.findings import Box
from rbstab.proof.check.ranges import Range
from rbstab.proof.check.states import Isolated, State
from rbstab.proof.check.taylor import Ball

LAMBDA = 3
"""The number of the variable that stands for a step."""


class AtJump(Isolated):
    """A rest state where a force that jumps holds the body.

    L(Θ, λ) is U with λ in place of the step that jumps, step(h). Its slope by λ is the jump of U,
    which is zero exactly where h = 0. Where U has slopes of opposite signs across this surface, on
    its two sides, all rest states are zeros of ∇L with 0 < λ < 1.
    """

    def __init__(self, U: Energy, state: State, range_: Range) -> None:
        super().__init__(U, state, range_)
        self.step = _step_that_jumps(U, state.enclosure)
        if self.step is not None:
            self.L = _with_share(U, self.step)

    @cached_property
    def _normal(self) -> list[Ball]:
        """The normal of the surface near the enclosure, not proved."""
        assert self.step is not None
        of = self.U.operations[self.step][2]
        series = self.U.all_series(_leaves(self.U, self.state.enclosure))[of]
        return [series.get(row, arb(0)).mid() for row in self.U.rows.first]

    @cached_property
    def _share(self) -> float:
        """λ near the rest state, not proved."""
        half = Bounds(self.L, (*self.state.enclosure, (0.5, 0.5)))
        n = range(3)
        jump = [half.H[i, 3].mid() for i in n]
        first = [half.gradient[i, 0].mid() - jump[i] / 2 for i in n]
        size = sum((x * x for x in jump), arb(0))
        return float((-sum((x * y for x, y in zip(first, jump, strict=True)), arb(0)) / size).mid())

    @cached_property
    def _near(self) -> Box:
        box = self.state.enclosure
        margin = 20 * max(b - a for a, b in box)
        return (*box, (self._share - margin, self._share + margin))

    @property
    def _is_unique(self) -> bool:
        return self.step is not None and self._has_no_other(self.state.enclosure)

    def _has_no_other(self, box: Box) -> bool:
        across = []
        for share in (0.0, 1.0):
            slopes = Bounds(self.L, (*box, (share, share))).slopes
            across.append(sum((n * g for n, g in zip(self._normal, slopes, strict=False)), arb(0)))
        before, after = across
        if not (before > 0 and after < 0 if self.state.ridge else before < 0 and after > 0):
            return False
        shares = self._shares(box, before)
        return shares is not None and Bounds(self.L, (*box, shares)).one_to_one()

    def _shares(self, box: Box, before: Ball) -> tuple[float, float] | None:
        """Return between which λ the slope of L across the surface is zero in a box.

        It is `before` where λ is zero, and changes by its slope along λ.
        """
        second = Bounds(self.L, (*box, (0.0, 1.0))).hessian
        growth = sum((n * second[i, 3] for i, n in enumerate(self._normal)), arb(0))
        share = -before / growth
        low, high = max(float(share.lower()), 0.0), min(float(share.upper()), 1.0)
        return (low, high) if low <= high else None

    @property
    def _exists(self) -> bool:
        low, high = self._near[3]
        zero = 0 < low < high < 1 and Bounds(self.L, self._near).contains_zero(self._near)
        return zero and self._is_on_surface

    @property
    def _is_on_surface(self) -> bool:
        """Return whether the zero of the jump lies on the surface: its normal meets it nearby.

        The jump is zero on the surface too, and grows along the normal in all of the domain.
        """
        assert self.step is not None
        of, first = self.U.operations[self.step][2], self.U.rows.first
        near = self.U.all_series(_leaves(self.U, self.state.enclosure))[of]
        over = self.U.all_series(_leaves(self.U, self.domain))[of]
        n = self._normal
        growth = sum((a * over.get(row, arb(0)) for a, row in zip(n, first, strict=True)), arb(0))
        pairs = zip(self.state.enclosure, self.domain, strict=True)
        room = min(min(a - c, d - b) for (a, b), (c, d) in pairs)
        size = max((abs(a) for a in n), key=float)
        return bool(abs(near.get(0, arb(0))) * size < growth * arb(room))

    @property
    def _index(self) -> int | None:
        """The index along the surface, + 1 on a ridge: ∇²L has one negative eigenvalue more."""
        index = Bounds(self.L, self._near).index
        return None if index is None else index - 1 + self.state.ridge


def no_rest_along_a_jump(U: Energy, box: Box) -> str | None:
    """Return "j" if no state in a box is at rest, on either side of a force that jumps there.

    All forces on both sides, and between them, are ∇L(Θ, λ) with 0 <= λ <= 1. Along directions
    across which the force does not jump, one of them has no zero.
    """
    step = _step_that_jumps(U, box)
    if step is None:
        return None
    over = Bounds(_with_share(U, step), (*box, (0.0, 1.0)))
    x, y, z = (over.H[i, LAMBDA].mid() for i in range(LAMBDA))
    for along in ((y, -x, 0), (z, 0, -x), (0, z, -y)):
        rows = range(LAMBDA)
        slope = sum((along[i] * over.gradient[i, 0] for i in rows), arb(0))
        for j, d in enumerate(over.step.entries()):
            slope += sum((along[i] * over.slope[i, j] for i in rows), arb(0)) * d
        if misses_zero(slope):
            return "j"
    return None


def _step_that_jumps(U: Energy, box: Box) -> int | None:
    """Return the only step that jumps in a box; None if it is not the only one."""
    values = U.all_series(_leaves(U, box))
    unknown = [
        k for k in U.steps if U.operations[k][1] == 1 and 0 in values[k] and not values[k][0] > 0
    ]
    return unknown[0] if len(unknown) == 1 else None


def _with_share(U: Energy, step: int) -> Energy:
    """Return L: U with λ in place of a step."""
    operations = list(U.operations)
    of = operations[step][2]
    # Beyond the surface too, all terms beside the step are those of its one side.
    same = ("sum", fmpq(0), ((fmpq(1), of),))
    operations = [same if one == ("positive", of) else one for one in operations]
    operations[step] = ("var", LAMBDA)
    return U.with_operations(operations, (*U.variables, LAMBDA))


def _leaves(U: Energy, box: Box) -> Mapping[int, Any]:
    values = [m + d for m, d in zip(*centre_and_steps(box), strict=True)]
    places = zip(U.variables, values, U.rows.first, strict=True)
    return {v: {0: x, row: arb(1)} for v, x, row in places}
