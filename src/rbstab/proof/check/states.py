"""One rest state: an enclosure of one zero of ∇U, or where a stop or a jump holds the body."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from flint import arb, fmpq

from rbstab.proof.check.bounds import Bounds, centre_and_steps, misses_zero
from rbstab.proof.check.cover import wider
from rbstab.proof.check.energy import Energy
from rbstab.proof.check.findings import Box
from rbstab.proof.check.least import bounds
from rbstab.proof.check.ranges import Face, Range
from rbstab.proof.check.taylor import Ball

LAMBDA = 3
"""The number of the variable that stands for a step."""

SHRINK = [0.5 * 0.7**k for k in range(60)]
"""rad: margins about an enclosure that are tried for its domain."""


@dataclass(frozen=True)
class State:
    """What is claimed of one rest state."""

    number: int
    enclosure: Box
    index: int | None
    held: bool
    ridge: bool

    @property
    def name(self) -> str:
        """Its name in sentences."""
        return f"rest state {self.number}"


class Isolated:
    """A rest state that is checked: whether its enclosure contains exactly one zero of ∇U.

    Args:
        U: The energy.
        state: What is claimed.
        range_: The range.
    """

    def __init__(self, U: Energy, state: State, range_: Range) -> None:
        self.U, self.state, self.range = U, state, range_

    @property
    def fault(self) -> str | None:
        """What is wrong with the claims; None if they are verified."""
        name = f"Rest state {self.state.number}"
        if not self._is_inside:
            return f"{name}: its enclosure is not inside the range."
        if not self._is_unique:
            return f"{name}: its enclosure may contain more than one."
        if not self._exists:
            return f"{name}: none could be shown in its enclosure."
        index = self._index
        if self.state.index is not None and index != self.state.index:
            return f"{name}: its index is {'not known' if index is None else index}."
        return None

    @property
    def _is_inside(self) -> bool:
        return self.range.contains(self.state.enclosure)

    @cached_property
    def _bounds(self) -> Bounds:
        return bounds(self.U, self.state.enclosure)

    @property
    def _is_unique(self) -> bool:
        return not self.state.ridge and self._bounds.one_to_one()

    @property
    def _exists(self) -> bool:
        return self._bounds.contains_zero(self.state.enclosure)

    @property
    def _index(self) -> int | None:
        return self._bounds.index

    def _has_no_other(self, box: Box) -> bool:
        """Return whether a box about the enclosure contains no other rest state."""
        return bounds(self.U, box).one_to_one()

    @cached_property
    def domain(self) -> Box:
        """A box about the enclosure in which there is no other rest state."""
        for margin in SHRINK:
            box = wider(self.state.enclosure, margin)
            if self._has_no_other(box):
                return box
        return self.state.enclosure


class AtStop(Isolated):
    """A rest state that a stop holds: a zero of ∇U along the face, on which U falls outwards."""

    @cached_property
    def face(self) -> Face:
        """The face."""
        side = 0 if self.state.enclosure[1][0] < 0 else 1
        return list(self.range.faces(1))[side]

    @property
    def _is_inside(self) -> bool:
        low, high = self.state.enclosure[1]
        place = self.face.place
        box = (self.state.enclosure[0], (0.0, 0.0), self.state.enclosure[2])
        on_face = bool(arb(low) <= place <= arb(high)) or bool(place.overlaps(arb(low)))
        return on_face and self.range.contains(box)

    @cached_property
    def _bounds(self) -> Bounds:
        return bounds(self.U, self.state.enclosure, (1, self.face.place))

    @property
    def _is_unique(self) -> bool:
        held = self._bounds.normal * self.face.side < 0
        return bool(held) and not self.state.ridge and self._bounds.one_to_one()

    def _has_no_other(self, box: Box) -> bool:
        return bounds(self.U, box, (1, self.face.place)).one_to_one()


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
