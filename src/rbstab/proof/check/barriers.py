"""Barriers: near the end of an angle U rises to infinity, so nothing is at rest there.

With d = cos θ2, or d = cos ½θ for the other angles, a barrier is a sum of terms c d^-k of U with
c > 0. Where its slope toward the end outweighs that of all else, U rises. To set the angle back to
where this begins never raises U.
"""

from collections.abc import Mapping

from flint import arb, fmpq

from rbstab.proof.check.bounds import Bounds
from rbstab.proof.check.cover import cover
from rbstab.proof.check.energy import ANGLES, Energy
from rbstab.proof.check.findings import Box, Cover
from rbstab.proof.check.taylor import Ball, derivative, leaf, unknown

GAPS = [2.0**-k for k in range(1, 28)]
"""rad: distances from the end that are tried, the longest first."""

LIMIT = 300
"""Boxes of one trial."""


def clear_of_barrier(
    U: Energy, axis: int, box: Box, end: Ball
) -> tuple[float | None, Mapping[str, Cover]]:
    """Return an angle from which on U rises to infinity, toward both ends, and how that was shown.

    Args:
        U: The energy.
        axis: The axis of the angle.
        box: The range of the others.
        end: The exact end of the angle.
    """
    poles = [(c, k) for c, k in U.terms if c > 0 and _is_pole(U, k, axis)]
    acts, barrier = {axis, *U.free}, U.with_terms(poles)
    rest = U.with_terms([(c, k) for c, k in U.terms if (c, k) not in poles and U.depends[k] & acts])

    def rises(part: Box) -> str | None:
        low, high = part[axis]
        inner, side = (low, 1) if low > 0 else (high, -1)
        # It is steepest toward the end, where the angle is largest.
        leaves = unknown([*ANGLES, *U.free]) | {axis: leaf(axis, arb(inner))}
        slope = derivative(barrier(leaves, 1)[-1], axis) + Bounds(rest, part).slopes[axis]
        return "r" if slope * side > 0 else None

    for gap in GAPS if poles else ():
        begin, covers = float((end - gap).mid()), dict[str, Cover]()
        for side in (-1, 1):
            part = (begin, box[axis][1]) if side > 0 else (box[axis][0], -begin)
            slab = (*box[:axis], part, *box[axis + 1 :])
            covers[f"θ{axis + 1} near {side * float(end.mid()):.6g}"] = cover(slab, rises, LIMIT)
        if all(side_cover.open is None for side_cover in covers.values()):
            return begin, covers
    return None, {}


def _is_pole(U: Energy, k: int, axis: int) -> bool:
    """Return whether an operation is d^-n with the angle of an axis."""
    match U.operations[k]:
        case "pow", n, j if n < 0 and U.operations[j][0] == "cos":
            match U.operations[U.operations[j][1]]:
                case "var", number:
                    return bool(axis == number == 1)
                case "sum", 0, ((factor, i),):
                    half = axis != 1 and factor == fmpq(1, 2)
                    return half and U.operations[i] == ("var", axis)
    return False
