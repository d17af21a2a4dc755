"""One rest state: an enclosure of one zero of ∇U, or where a stop or a jump holds the body."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from flint import arb, fmpq

from rbstab.proof.check.bounds import Bounds, centre_and_steps, misses_zero
from rbstab.proof.check.cover import flattened, wider, width
from rbstab.proof.check.energy import ANGLES, Energy
from rbstab.proof.check.findings import Box
from rbstab.proof.check.ranges import Face, Range
from rbstab.proof.check.taylor import Ball, Series

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
        face: The face of a stop that holds the body: then a zero of ∇U along it, on which U falls
            outwards. None without one.
    """

    def __init__(self, U: Energy, state: State, range_: Range, face: Face | None = None) -> None:
        self.U, self.state, self.range, self.face = U, state, range_, face
        self.flat = None if face is None else (face.axis, face.place)
        self.side = 0 if face is None else face.side

    @property
    def fault(self) -> str | None:
        """What is wrong with the claims; None if they are verified."""
        name, state = f"Rest state {self.state.number}", self.state
        inner = state.enclosure if self.face is None else flattened(state.enclosure, 1)
        if not self.range.contains(inner):
            return f"{name}: its enclosure is not inside the range."
        if not self._is_unique:
            return f"{name}: its enclosure may contain more than one."
        if not self._exists:
            return f"{name}: none could be shown in its enclosure."
        index = self._index
        if state.index is not None and index != state.index:
            return f"{name}: its index is {'not known' if index is None else index}."
        return None

    @cached_property
    def _bounds(self) -> Bounds:
        return Bounds(self.U, self.state.enclosure, self.flat)

    @property
    def _is_unique(self) -> bool:
        held = self.face is None or self._bounds.normal * self.face.side < 0
        return bool(held) and not self.state.ridge and self._bounds.one_to_one()

    @property
    def _exists(self) -> bool:
        return self._bounds.contains_zero()

    @property
    def _index(self) -> int | None:
        return self._bounds.index

    def _has_no_other(self, box: Box) -> bool:
        """Return whether a box about the enclosure contains no other rest state."""
        return Bounds(self.U, box, self.flat).one_to_one()

    @cached_property
    def domain(self) -> Box:
        """A box about the enclosure in which there is no other rest state."""
        boxes = (wider(self.state.enclosure, margin) for margin in SHRINK)
        return next(filter(self._has_no_other, boxes), self.state.enclosure)


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

    def _of_surface(self, box: Box) -> tuple[Ball, list[Ball]]:
        """Return h and ∇h over a box."""
        assert self.step is not None
        h = _all_over(self.U, box)[self.U.operations[self.step][2]]
        return h.get(0, arb(0)), [h.get(row, arb(0)) for row in self.U.rows.first]

    @cached_property
    def _normal(self) -> list[Ball]:
        """The normal of the surface near the enclosure, not proved."""
        return [x.mid() for x in self._of_surface(self.state.enclosure)[1]]

    @cached_property
    def _near(self) -> Bounds:
        """Bounds of L about the enclosure and all λ there."""
        box = self.state.enclosure
        low, high = self._shares(box) or (0.0, 0.0)
        margin = 20 * width(box)
        return Bounds(self.L, (*box, (low - margin, high + margin)))

    @property
    def _is_unique(self) -> bool:
        return self.step is not None and self._has_no_other(self.state.enclosure)

    def _has_no_other(self, box: Box) -> bool:
        shares = self._shares(box)
        return shares is not None and Bounds(self.L, (*box, shares)).one_to_one()

    def _shares(self, box: Box) -> tuple[float, float] | None:
        """Return between which λ the slope across the surface is zero; None if it may not be."""
        before, after = (
            _dot(self._normal, Bounds(self.L, (*box, (share, share))).slopes)
            for share in (0.0, 1.0)
        )
        if not (before > 0 and after < 0 if self.state.ridge else before < 0 and after > 0):
            return None
        # It is `before` where λ is zero, and changes by its slope along λ.
        second = Bounds(self.L, (*box, (0.0, 1.0))).hessian
        share = -before / _dot(self._normal, [second[i, 3] for i in ANGLES])
        low, high = max(float(share.lower()), 0.0), min(float(share.upper()), 1.0)
        return (low, high) if low <= high else None

    @property
    def _exists(self) -> bool:
        """Whether L has a zero of its slopes on the surface: its normal meets it nearby.

        The jump is zero on the surface too, and grows along the normal in all of the domain.
        """
        low, high = self._near.box[3]
        if not (0 < low < high < 1 and self._near.contains_zero()):
            return False
        n, (h, _) = self._normal, self._of_surface(self.state.enclosure)
        growth = _dot(n, self._of_surface(self.domain)[1])
        pairs = zip(self.state.enclosure, self.domain, strict=True)
        room = min(min(a - c, d - b) for (a, b), (c, d) in pairs)
        return bool(abs(h) * max((abs(a) for a in n), key=float) < growth * arb(room))

    @property
    def _index(self) -> int | None:
        """The index along the surface, + 1 on a ridge: ∇²L has one negative eigenvalue more."""
        index = self._near.index
        return None if index is None else index - 1 + self.state.ridge


def isolated(U: Energy, state: State, range_: Range) -> Isolated:
    """Return the check of a rest state, by what holds the body there."""
    low, high = (arb(x) for x in state.enclosure[1])
    if not state.held:
        return Isolated(U, state, range_)
    for face in range_.faces(1) if range_.stop is not None else ():
        if low <= face.place <= high or face.place.overlaps(low):
            return Isolated(U, state, range_, face)
    return Isolated(U, state, range_) if U.free else AtJump(U, state, range_)


def no_rest_along_a_jump(U: Energy, box: Box) -> str | None:
    """Return "j" if no state in a box is at rest, on either side of a force that jumps there.

    All forces on both sides, and between them, are ∇L(Θ, λ) with 0 <= λ <= 1. Along directions
    across which the force does not jump, one of them has no zero.
    """
    step = _step_that_jumps(U, box)
    if step is None:
        return None
    over = Bounds(_with_share(U, step), (*box, (0.0, 1.0)))
    x, y, z = (over.H[i, LAMBDA].mid() for i in ANGLES)
    for along in ((y, -x, 0), (z, 0, -x), (0, z, -y)):
        slope = _dot(along, over.gradient.entries())
        for j, d in enumerate(over.step.entries()):
            slope += _dot(along, [over.slope[i, j] for i in ANGLES]) * d
        if misses_zero(slope):
            return "j"
    return None


def _dot(x: Sequence[Ball], y: Sequence[Ball]) -> Ball:
    """Return x'y in three variables."""
    return sum((a * b for a, b in zip(x, y, strict=False)), arb(0))


def _step_that_jumps(U: Energy, box: Box) -> int | None:
    """Return the only step that jumps in a box; None if it is not the only one."""
    values = _all_over(U, box)
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
    return Energy(operations, (*U.variables, LAMBDA))


def _all_over(U: Energy, box: Box) -> list[Series]:
    """Return the series of all operations over a box."""
    places = enumerate(zip(*centre_and_steps(box), strict=True))
    return U([U.rows.leaf(i, m + d) for i, (m, d) in places])
