"""The results of checking a proof, and the ranges of Θ that they are about."""

import math
from collections.abc import Iterator, Mapping
from typing import NamedTuple

from flint import arb

from rbstab.analysis.proof_check.boxes import AXES, Box
from rbstab.analysis.proof_check.cover import Cover
from rbstab.analysis.proof_check.trigonometric import Ball

IN_RANGE = "the range of eq. 5"
UNWRAPPED = "all θ1 and θ3"

TIME = "time"
"""The claim of a finding that the check takes too long: then the proof is not refused."""


class Finding(NamedTuple):
    """One claim of a proof, and whether it was verified.

    Attributes:
        about: The range of Θ.
        claim: The name of the claim.
        verified: Whether it is verified. If not, it is wrong, or could not be confirmed.
        text: Sentences: what was checked, or what is wrong.
        covers: The boxes by which it was checked, by the name of the place that they cover.
    """

    about: str
    claim: str
    verified: bool
    text: str
    covers: Mapping[str, Cover] = {}

    @property
    def boxes(self) -> int:
        """The number of boxes that were examined."""
        return sum(found.boxes for found in self.covers.values())


class Face(NamedTuple):
    """One of the six faces of a range.

    Attributes:
        name: Its name in sentences.
        axis: The axis along which it is flat.
        end: 0 for the lower end of this axis, 1 for the upper one.
        place: Its exact place on this axis, a ball.
    """

    name: str
    axis: int
    end: int
    place: Ball


class Range(NamedTuple):
    """The range |θ_i| < e_i.

    Attributes:
        name: Its name in sentences.
        ends: e, three balls, rad.
        box: A box of doubles that contains it.
        closed: The axes along which a barrier or a stop closes it, so that these faces are no
            border. With a barrier, U rises with the size of the angle from e_i on, to infinity.
    """

    name: str
    ends: tuple[Ball, ...]
    box: Box
    closed: tuple[int, ...] = ()

    @property
    def faces(self) -> Iterator[Face]:
        """Its six faces, but for those that are no border."""
        for axis in (one for one in AXES if one not in self.closed):
            for end, sign in enumerate((-1, 1)):
                place = sign * self.ends[axis]
                yield Face(f"θ{axis + 1} = {float(place):.6g}", axis, end, place)


def range_with(name: str, ends: tuple[Ball, ...], *, closed: tuple[int, ...] = ()) -> Range:
    """Return the range with some ends."""
    upper = [math.nextafter(float(end), math.inf) for end in ends]
    assert all(arb(high) > end for high, end in zip(upper, ends, strict=True))
    return Range(name, ends, tuple((-high, high) for high in upper), closed)
