"""Bounds for all Θ: on z wherever ∂W/∂z = 0, and on the slopes of W there.

With springs alone z = -S⁻¹Σ w_j u_j. Else all of W but the lines of springs is convex in z: let its
derivative by z be g. Where ∂W/∂z = 0, |g| <= Σ |w_j|, and the only point with such a g is in each
box on whose faces g points outwards by more than Σ |w_j|, entry by entry (Miranda).
"""

from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from typing import Any

from flint import arb

from rbstab.analysis.proof_check.boxes import AXES, Box
from rbstab.analysis.proof_check.formulas import series
from rbstab.analysis.proof_check.tied.energy import Pose, TiedEnergy
from rbstab.analysis.proof_check.trigonometric import Ball, square

PARTS = ((4, 2, 4), (8, 4, 8))
"""The boxes of Θ by axis; the second ones are tried if the first ones are too wide."""

ENDS = (3.1416, 1.5708, 3.1416)
"""rad: all Θ of the range of eq. 5 are within; what is periodic has no other values elsewhere."""

FIRST, WIDER, TRIES = 1e-4, 1.5, 40
"""The first bound on z, m, the factor to the next one, and their number."""


class BoundedEnergy(TiedEnergy):
    """W with bounds for all Θ.

    Args:
        data: `tied_energy` of a proof.

    Attributes:
        scale: Bounds on |z_i| wherever ∂W/∂z = 0, m.

    Raises:
        ValueError: As of `TiedEnergy`, or no bound on z is found.
    """

    def __init__(self, data: Mapping[str, Any]) -> None:
        super().__init__(data)
        self.scale = self._box() if self.is_smooth else self._of_springs()
        self.U.slopes = [self._steepest(axis) for axis in AXES]

    @property
    def periodic(self) -> bool:
        """Whether these bounds hold for all θ1 and θ3."""
        return all(one.periodic for one in self.formulas)

    def _of_springs(self) -> list[Ball]:
        """Return the norms of the rows of S⁻¹ times Σ |w_j|."""
        rows = [sum((square(self.compliance[i, j]) for j in AXES), arb(0)) for i in AXES]
        return [(row.sqrt() * self.pull).abs_upper() for row in rows]

    def _box(self) -> list[Ball]:
        for parts in PARTS:
            bound = [arb(FIRST)] * 3
            poses = [Pose(self, cell) for cell in _cells(parts)]
            for _ in range(TRIES):
                inside = [self._points_outwards(poses, bound, axis) for axis in AXES]
                if all(inside):
                    return bound
                bound = [b if one else b * WIDER for b, one in zip(bound, inside, strict=True)]
        raise ValueError("z is not shown to be bounded")

    def _points_outwards(self, poses: list[Pose], bound: Sequence[Ball], axis: int) -> bool:
        """Return whether g points outwards on both faces along an axis."""
        for place, (pose, side) in enumerate(product(poses, (-1, 1))):
            z = [one * arb(0, 1) for one in bound]
            z[axis] = side * bound[axis]
            values = pose.at(z, "over")
            g = values.pulled[axis] + sum((one[axis] for one in values.others), arb(0))
            if not side * g > self.pull:
                # The next, wider box most likely fails there too.
                poses.insert(0, poses.pop(place // 2))
                return False
        return True

    def _steepest(self, axis: int) -> Ball:
        """Bound the slope of all that depends on z: a unit vector times w ∂r/∂θ of springs."""
        total = arb(0)
        for line in self.lines:
            squares = (square(one.steepest(axis)) for one in line.offset)
            total += abs(line.weight) * sum(squares, arb(0)).abs_upper().sqrt()
        if not self.is_smooth:
            return total
        z = [one * arb(0, 1) for one in self.scale]
        first = len(self.lines)
        most = arb(0)
        for cell in _cells(PARTS[-1]):
            values = Pose(self, cell).at(z, "over")
            parts = [end.slopes[axis] for end in values.ends[first:]]
            parts += [series.slope(one, axis) for one in values.formulas]
            size = sum((abs(one) for one in parts), arb(0)).abs_upper()
            most = most.max(size) if size.is_finite() else arb.pos_inf()
        return total + most


def _cells(parts: Sequence[int]) -> Iterator[Box]:
    """Yield boxes of Θ that cover the range of eq. 5."""
    for places in product(*map(range, parts)):
        yield tuple(
            (-end + 2 * end * place / count, -end + 2 * end * (place + 1) / count)
            for end, place, count in zip(ENDS, places, parts, strict=True)
        )
