"""Barriers: near the end of an angle U rises to infinity, so nothing is at rest there.

With d = cos θ2, or d = cos ½θ for the other angles, a barrier is a sum of terms c d^-k of U with
c > 0. Where its slope toward the end outweighs that of all else, U rises. To set the angle back to
where this begins never raises U.
"""

from collections.abc import Mapping

from flint import arb, fmpq

from rbstab.proof.check.bounds import Bounds
from rbstab.proof.check.cover import cover
from rbstab.proof.check.energy import Energy
from rbstab.proof.check.findings import Box, Cover
from rbstab.proof.check.taylor import Ball, whole_power

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
    share = fmpq(1) if axis == 1 else fmpq(1, 2)
    poles = {k: n for c, k in U.terms if c > 0 and (n := _power(U, k, axis, share))}
    barrier = [(arb(c), poles[k]) for c, k in U.terms if k in poles]
    acts = {axis, *U.free}
    rest = U.with_terms([(c, k) for c, k in U.terms if k not in poles and U.depends[k] & acts])

    def rises(part: Box) -> str | None:
        found = Bounds(rest, part)
        theta = abs(found.middle[axis] + found.steps[axis]) * share
        # Least where the angle is farthest from its end: there d is largest.
        d, turn = arb(theta.cos().upper()), share * theta.sin()
        slope = sum((c * n * turn / whole_power(d, n + 1) for c, n in barrier), arb(0))
        toward = found.slopes[axis] * (1 if part[axis][0] > 0 else -1)
        return "r" if slope.lower() + toward > 0 else None

    for gap in GAPS if barrier else ():
        begin, covers = float((end - gap).mid()), dict[str, Cover]()
        for side in (-1, 1):
            part = (begin, box[axis][1]) if side > 0 else (box[axis][0], -begin)
            slab = (*box[:axis], part, *box[axis + 1 :])
            covers[f"θ{axis + 1} near {side * float(end.mid()):.6g}"] = cover(slab, rises, LIMIT)
        if all(found.open is None for found in covers.values()):
            return begin, covers
    return None, {}


def _power(U: Energy, k: int, axis: int, share: fmpq) -> int:
    """Return n of an operation d^-n; 0 if it is another one."""
    match U.operations[k]:
        case "pow", n, j if n < 0 and U.operations[j][0] == "cos":
            angle = U.operations[U.operations[j][1]]
            if share != 1 and angle[:2] == ("sum", 0) and [c for c, _ in angle[2]] == [share]:
                return -n if U.operations[angle[2][0][1]] == ("var", axis) else 0
            return -n if share == 1 and angle == ("var", axis) else 0
    return 0
