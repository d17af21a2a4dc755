"""The ranges of Θ that claims are about: their ends, faces, stops and barriers."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from flint import arb

from rbstab.proof.check.barriers import clear_of_barrier
from rbstab.proof.check.bounds import Face
from rbstab.proof.check.energy import ANGLES, Energy, rational
from rbstab.proof.check.findings import EVERYWHERE, IN_RANGE, Box, Finding, RefusedError
from rbstab.proof.check.taylor import Ball

FARTHEST_END = 100
"""rad: the largest end of θ1 and θ3."""


@dataclass(frozen=True)
class Range:
    """The range |θ_i| <= e_i.

    Attributes:
        name: Its name in sentences.
        ends: e, three balls, rad.
        box: A box of doubles that contains it, but for what is clear of rest states at barriers.
        closed: The axes along which a barrier or a stop closes it.
        stop: The largest |θ2| that a stop allows; None without one.
    """

    name: str
    ends: tuple[Ball, ...]
    box: Box
    closed: frozenset[int]
    stop: Ball | None

    @property
    def border(self) -> Iterator[Face]:
        """The faces through which a motion may leave it."""
        for axis in ANGLES:
            if axis not in self.closed:
                yield from self.faces(axis)

    def faces(self, axis: int) -> Iterator[Face]:
        """Yield both faces along an axis."""
        for side in (-1, 1):
            place = side * self.ends[axis]
            yield Face(f"θ{axis + 1} = {float(place.mid()):.6g}", axis, side, place)

    @cached_property
    def held_at(self) -> list[Face]:
        """The faces of a stop."""
        return [] if self.stop is None else list(self.faces(1))

    def contains(self, box: Box) -> bool:
        """Return whether a box lies inside."""
        inner = zip(box, self.box, self.ends, strict=True)
        return all(c < a and b < d and -e < arb(a) and arb(b) < e for (a, b), (c, d), e in inner)

    def reaches(self, face: Face, box: Box) -> bool:
        """Return whether a part of the box of the range touches a face."""
        k = 0 if face.side < 0 else 1
        return box[face.axis][k] == self.box[face.axis][k]


def range_of(U: Energy, energy: Any, claims: Any) -> tuple[Range, list[Finding]]:
    """Return the range of some claims, and what was found about its closed faces.

    Args:
        U: The energy.
        energy: What the record says of it: its stop, rad, and the axes that are closed.
        claims: What the record claims of the range: its ends, rad, and whether it is everywhere.

    Raises:
        RefusedError: Its ends are no angles.
    """
    everywhere = bool(claims.get("everywhere"))
    name = EVERYWHERE if everywhere else IN_RANGE
    ends = [_end(end) for end in claims["end"]]
    stop = None if energy["stop"] is None else arb(rational(energy["stop"]))
    most = [arb.pi(), arb.pi() / 2 if stop is None else stop, arb.pi()]
    if len(ends) != 3 or not (stop is None or stop < arb.pi() / 2):
        raise RefusedError("the range has no three ends, or a stop is beyond it")
    for axis, (e, whole) in enumerate(zip(ends, most, strict=True)):
        wide = everywhere and axis != 1
        if not (0 < e < FARTHEST_END if wide else e.overlaps(whole)):
            raise RefusedError(f"θ{axis + 1} has another range")
    closed, findings = set[int](), list[Finding]()
    if stop is not None:
        closed.add(1)
        text = f"A stop keeps every motion at |θ2| <= {float(stop.mid()):.6g} rad."
        findings.append(Finding(name, "stop", True, text))
    high = [math.nextafter(float(e.upper()), math.inf) for e in ends]
    box: Box = tuple((-x, x) for x in high)
    for axis in sorted(set(energy["closed"]) - closed):
        if everywhere and axis != 1:
            raise RefusedError("barriers on θ1 and θ3 divide the range")
        last, covers = clear_of_barrier(U, axis, box, most[axis])
        angle = f"|θ{axis + 1}|"
        text = f"That U rises with {angle} near the end of the range could not be confirmed."
        if last is not None:
            text = f"U rises with {angle} from {last:.6g} rad on: no rest state is there."
            closed.add(axis)
            box = (*box[:axis], (-last, last), *box[axis + 1 :])
        findings.append(Finding(name, "barrier", last is not None, text, covers))
    return Range(name, (*ends,), box, frozenset(closed), stop), findings


def _end(value: Any) -> Ball:
    """Return the end of a range as a ball: "pi", "pi/2", a rational number, or a double."""
    if value in ("pi", "pi/2"):
        return arb.pi() / (1 if value == "pi" else 2)
    return arb(value) if isinstance(value, float) else arb(rational(value))


def box_of(corners: Sequence[Sequence[float]]) -> Box:
    """Return the box between two corners.

    Raises:
        RefusedError: They are no corners of a box of Θ.
    """
    low, high = corners
    box = tuple((float(a), float(b)) for a, b in zip(low, high, strict=True))
    if len(box) != 3 or not all(math.isfinite(a) and math.isfinite(b) and a <= b for a, b in box):
        raise RefusedError("a box has no proper corners")
    return box
