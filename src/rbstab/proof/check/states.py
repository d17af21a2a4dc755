"""The rest states of a range: each is the only one in its enclosure, and there are no others."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from flint import arb, fmpq

from rbstab.proof.check.bounds import Bounds, centre_and_steps
from rbstab.proof.check.cover import cover, disjoint, flattened, wider, within
from rbstab.proof.check.findings import Box, Cover, Finding, RefusedError
from rbstab.proof.check.least import bounds
from rbstab.proof.check.ranges import Face, Range, box_of
from rbstab.proof.check.taylor import Ball, Energy

SHRINK = [0.5 * 0.7**k for k in range(60)]
"""rad: margins about an enclosure that are tried for its domain."""

AROUND_UNDECIDED = 1e-6
"""rad: the cover leaves out so much about undecided boxes, so that it ends."""

LAMBDA = 3
"""The number of the variable that stands for a step."""

MOST_PLACES = 1000
"""The most rest states and undecided boxes of a range."""


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


def states_of(claims: Any) -> list[State]:
    """Return the rest states that are claimed.

    Raises:
        RefusedError: They cannot be read.
    """
    listed = claims["states"]
    if len(listed) + len(claims.get("undecided", [])) > MOST_PLACES:
        raise RefusedError(f"there are more than {MOST_PLACES} rest states and undecided boxes")
    found = list[State]()
    for number, one in enumerate(listed, start=1):
        box, index = box_of(one["enclosure"]), one["index"]
        if not (index is None or (type(index) is int and 0 <= index <= 3)):
            raise RefusedError("an index is no number from 0 to 3")
        found.append(State(number, box, index, bool(one.get("held")), bool(one.get("ridge"))))
    return found


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


class AtJump(Isolated):
    """A rest state where a force that jumps holds the body.

    L(Θ, λ) is U with λ in place of the step that jumps, step(h). Its slope by λ is the jump of U,
    which is zero exactly where h = 0. Where U has slopes of opposite signs across this surface, on
    its two sides, all rest states are zeros of ∇L with 0 < λ < 1.
    """

    def __init__(self, U: Energy, state: State, range_: Range) -> None:
        super().__init__(U, state, range_)
        self.step = self._step_that_jumps()
        if self.step is not None:
            operations = list(U.operations)
            of = operations[self.step][2]
            # Beyond the surface too, all terms beside the step are those of its one side.
            same = ("sum", fmpq(0), ((fmpq(1), of),))
            operations = [same if one == ("positive", of) else one for one in operations]
            operations[self.step] = ("var", LAMBDA)
            self.L = U.with_operations(operations, (*U.variables, LAMBDA))

    def _step_that_jumps(self) -> int | None:
        """Return the only step that jumps in the enclosure; None if it is not the only one."""
        leaves = self._leaves(self.state.enclosure)
        values = self.U.all_series(leaves)
        unknown = [
            k
            for k in self.U.steps
            if self.U.operations[k][1] == 1 and 0 in values[k] and not values[k][0] > 0
        ]
        return unknown[0] if len(unknown) == 1 else None

    def _leaves(self, box: Box) -> Mapping[int, Any]:
        values = [m + d for m, d in zip(*centre_and_steps(box), strict=True)]
        places = zip(self.U.variables, values, self.U.rows.first, strict=True)
        return {v: {0: x, row: arb(1)} for v, x, row in places}

    @cached_property
    def _normal(self) -> list[Ball]:
        """The normal of the surface near the enclosure, not proved."""
        assert self.step is not None
        of = self.U.operations[self.step][2]
        series = self.U.all_series(self._leaves(self.state.enclosure))[of]
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
        if not Bounds(self.L, (*box, (0.0, 1.0))).one_to_one():
            return False
        across = []
        for share in (0.0, 1.0):
            slopes = Bounds(self.L, (*box, (share, share))).slopes
            across.append(sum((n * g for n, g in zip(self._normal, slopes, strict=False)), arb(0)))
        before, after = across
        return bool(before > 0 and after < 0 if self.state.ridge else before < 0 and after > 0)

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
        near = self.U.all_series(self._leaves(self.state.enclosure))[of]
        over = self.U.all_series(self._leaves(self.domain))[of]
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


def isolated(U: Energy, state: State, range_: Range) -> Isolated:
    """Return the check of a rest state, by what holds the body there."""
    if not state.held or U.free:
        return Isolated(U, state, range_)
    low, high = state.enclosure[1]
    at_stop = range_.stop is not None and any(
        arb(low) <= face.place <= arb(high) or face.place.overlaps(arb(low))
        for face in range_.faces(1)
    )
    return AtStop(U, state, range_) if at_stop else AtJump(U, state, range_)


class Listed:
    """The rest states of a range that a proof claims, and boxes that it leaves undecided.

    Args:
        U: The energy.
        claims: The claims.
        range_: The range.
    """

    def __init__(self, U: Energy, claims: Any, range_: Range) -> None:
        self.U, self.range = U, range_
        self.states = states_of(claims)
        self.undecided = [box_of(one) for one in claims.get("undecided", [])]
        self.complete = claims["complete"] is True
        self.checks = [isolated(U, one, range_) for one in self.states]

    def findings(self) -> Iterator[Finding]:
        """Check that each is isolated, and that there is no other."""
        wrong = [fault for one in self.checks if (fault := one.fault) is not None]
        if not disjoint(one.enclosure for one in self.states):
            wrong.append("Two enclosures have a point in common.")
        if self.complete and self.undecided:
            wrong.append("The rest states are said to be all, but some boxes are undecided.")
        text = f"{len(self.states)} are isolated, each in its enclosure."
        yield Finding(self.range.name, "rest states", not wrong, " ".join(wrong) or text)
        if wrong:
            return
        covers = {"range": self._cover_of_range()}
        if self.range.stop is not None:
            for face in self.range.faces(1):
                covers[face.name] = self._cover_of_stop(face)
        opened = next((one.open for one in covers.values() if one.open is not None), None)
        outside = f" outside of {len(self.undecided)} undecided boxes" if self.undecided else ""
        text = f"There is no other{outside}."
        if opened is not None:
            shown = ", ".join(f"[{a:.6g}, {b:.6g}]" for a, b in opened)
            text = f"The box {shown} may contain one that is not listed."
        yield Finding(self.range.name, "no other rest state", opened is None, text, covers)

    @cached_property
    def _undecided_places(self) -> dict[str, Box]:
        return {f"u{k}": wider(b, AROUND_UNDECIDED) for k, b in enumerate(self.undecided, start=1)}

    def _cover_of_range(self) -> Cover:
        inner = [one for one in self.checks if not isinstance(one, AtStop)]
        places = {f"s{one.state.number}": one.domain for one in inner} | self._undecided_places

        def reason(box: Box) -> str | None:
            for name, place in places.items():
                if within(box, place):
                    return name
            return bounds(self.U, box).excludes_zero()

        return cover(self.range.box, reason)._replace(places=places)

    def _cover_of_stop(self, face: Face) -> Cover:
        """Cover a stop by boxes on which U rises outwards, or no other state is."""
        on_it = [
            one for one in self.checks if isinstance(one, AtStop) and one.face.side == face.side
        ]
        places = {f"s{one.state.number}": flattened(one.domain, 1) for one in on_it}
        places |= {
            name: flattened(box, 1)
            for name, box in self._undecided_places.items()
            if arb(box[1][0]) <= face.place <= arb(box[1][1])
        }

        def reason(box: Box) -> str | None:
            for name, place in places.items():
                if within(box, place):
                    return name
            over = bounds(self.U, box, (face.axis, face.place))
            return "f" if over.normal * face.side > 0 else over.excludes_zero()

        return cover(flattened(self.range.box, 1), reason)._replace(places=places)

    def places_but(self, state: State) -> dict[str, Box]:
        """Return boxes with all rest states but one, by name."""
        others = {one.name: one.enclosure for one in self.states if one is not state}
        return others | {
            f"undecided box {name[1:]}": b for name, b in self._undecided_places.items()
        }
