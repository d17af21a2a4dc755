"""All rest states with any real θ1 and θ3 lie in a range: theorem 6 of docs/proofs.md.

With U = ½ Θ'KΘ + q'Θ + p(Θ), p periodic in θ1 and θ3, and the block k of K for these, the slopes
of U grow by 2πk n over n whole turns. So a rest state that is n turns from Θ has

    2πn = -k⁻¹ [∂U/∂θ1, ∂U/∂θ3].

The right-hand side is bounded on a cover of one period, which gives the turns of each box.
"""

import math

from flint import arb, arb_mat

from rbstab.proof.check.bounds import Bounds
from rbstab.proof.check.cover import cover
from rbstab.proof.check.energy import ANGLES, Energy, operands
from rbstab.proof.check.findings import Box, Cover, Finding, confirmed
from rbstab.proof.check.matrices import column
from rbstab.proof.check.ranges import Range

OUTER = (0, 2)

MOST_TURNS = 17
"""Where more are possible, a box is halved."""

PERIOD = 3.1416
"""rad: more than π."""


def confinement(U: Energy, range_: Range) -> Finding:
    """Check by theorem 6 that no rest state is beyond the ends of θ1 and θ3."""
    first, third = (float(range_.ends[i].mid()) for i in OUTER)
    text = f"All of them have |θ1| < {first:.5g} and |θ3| < {third:.5g} rad"
    k = _stiffness(U)
    covers = {} if k is None else {"one period": _confined(U, range_, k.inv() / (2 * arb.pi()))}
    return confirmed(range_.name, "ends", text, covers, verified=k is not None)


def _stiffness(U: Energy) -> arb_mat | None:
    """Return k; None if U has another form, or k is not definite."""
    (k, others), periodic = U.quadratic(OUTER), _periodic(U)
    products = (set(U.products[j]) for _, j in others if not periodic[j])
    fits = all(factors and factors <= {*ANGLES} for factors in products)
    return k if fits and k[0, 0] > 0 and k.det() > 0 else None


def _periodic(U: Energy) -> list[bool]:
    """Return whether θ1 and θ3 stand in sines and cosines alone, for each operation."""
    periodic = list[bool]()
    for operation in U.operations:
        match operation:
            case "var", number:
                periodic.append(number not in OUTER)
            case "sin" | "cos", j if U.operations[j][0] == "var":
                periodic.append(True)
            case _:
                periodic.append(all(periodic[j] for j in operands(operation)))
    return periodic


def _confined(U: Energy, range_: Range, per_turn: arb_mat) -> Cover:
    """Cover a period by boxes that show that all rest states have |θ1| < e1 and |θ3| < e3."""

    def reason(box: Box) -> str | None:
        over = Bounds(U, box)
        turns = (per_turn * column([-over.slopes[i] for i in OUTER])).entries()
        if not all(abs(n) < MOST_TURNS for n in turns):
            return None
        possible = [[n for n in range(-MOST_TURNS, MOST_TURNS + 1) if x.contains(n)] for x in turns]
        inside = all(
            abs(over.middle[i] + over.steps[i] + 2 * n * arb.pi()) < range_.ends[i]
            for i, numbers in zip(OUTER, possible, strict=True)
            for n in numbers
        )
        return "c" if inside or [] in possible else None

    pitch = math.nextafter(float(range_.ends[1].upper()), math.inf)
    period = (-PERIOD, PERIOD)
    return cover((period, (-pitch, pitch), period), reason)
