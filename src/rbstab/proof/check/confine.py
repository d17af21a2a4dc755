"""All rest states with any real θ1 and θ3 lie in a range: theorem 6 of docs/proofs.md.

With U = ½ Θ'KΘ + q'Θ + p(Θ), p periodic in θ1 and θ3, and the block k of K for these, at rest

    [θ1, θ3] = -k⁻¹ [q_j + K_j2 θ2 + ∂p/∂θ_j],    j in {1, 3}.

The right-hand side is bounded on a cover of one period. In each box, the whole turns that may be
added to θ1 and θ3 are those with which they meet their right-hand sides.
"""

import math
from typing import Any

from flint import arb, arb_mat

from rbstab.proof.check.bounds import Bounds
from rbstab.proof.check.cover import cover
from rbstab.proof.check.energy import Energy, operands
from rbstab.proof.check.findings import Box, Cover, Finding, confirmed
from rbstab.proof.check.ranges import Range
from rbstab.proof.check.taylor import Ball

OUTER = (0, 2)

MOST_ANGLE = 100
"""rad: where the right-hand side may be larger, a box is halved."""

MOST_TURNS = 17
"""More than `MOST_ANGLE` and a period."""

PERIOD = 3.1416
"""rad: more than π."""


def _periodic(U: Energy) -> list[bool]:
    """Return whether θ1 and θ3 stand in sines and cosines alone, for each operation."""
    found = list[bool]()
    for one in U.operations:
        match one:
            case "var", number:
                found.append(number not in OUTER)
            case "sin" | "cos", j if U.operations[j][0] == "var":
                found.append(True)
            case _:
                found.append(all(found[j] for j in operands(one)))
    return found


def confinement(U: Energy, range_: Range) -> Finding:
    """Check by theorem 6 that no rest state is beyond the ends of θ1 and θ3."""
    first, third = (float(range_.ends[i].mid()) for i in OUTER)
    text = f"All of them have |θ1| < {first:.5g} and |θ3| < {third:.5g} rad"
    found = confined(U, range_)
    covers = {} if found is None else {"one period": found}
    return confirmed(range_.name, "ends", text, covers, verified=found is not None)


def confined(U: Energy, range_: Range) -> Cover | None:
    """Cover a period by boxes that show that all rest states have |θ1| < e1 and |θ3| < e3.

    Returns:
        The cover; None if U has another form, or k is not definite.
    """
    K, q, rest = arb_mat(3, 3), [arb(0)] * 3, list[tuple[Any, int]]()
    for c, j in U.terms:
        factors = U.products[j]
        if factors is None or max(factors) > max(OUTER):
            # What depends on θ2 alone has no slope along the others.
            rest += [] if U.depends[j] == {1} else [(c, j)]
        elif len(factors) == 1:
            q[factors[0]] += arb(c)
        else:
            K[factors[0], factors[1]] += arb(c)
            K[factors[1], factors[0]] += arb(c)
    periodic = _periodic(U)
    k = arb_mat([[K[i, j] for j in OUTER] for i in OUTER])
    if not (k[0, 0] > 0 and k.det() > 0 and all(periodic[j] for _, j in rest)):
        return None
    rest_of_U = U.with_terms(rest)
    inverse = k.inv()
    ends = [range_.ends[i] for i in OUTER]

    def reason(box: Box) -> str | None:
        over = Bounds(rest_of_U, box)
        theta = [m + d for m, d in zip(over.middle, over.steps, strict=True)]
        load = arb_mat([[q[j] + K[j, 1] * theta[1] + over.slopes[j]] for j in OUTER])
        pairs = zip(OUTER, (inverse * load).entries(), strict=True)
        possible = [_turns(theta[i], x) for i, x in pairs]
        if None in possible:
            return None
        inside = all(abs(t) < e for ts, e in zip(possible, ends, strict=True) for t in ts or [])
        return "c" if inside or [] in possible else None

    pitch = math.nextafter(float(range_.ends[1].upper()), math.inf)
    period = (-PERIOD, PERIOD)
    return cover((period, (-pitch, pitch), period), reason)


def _turns(theta: Ball, x: Ball) -> list[Ball] | None:
    """Return all θ + 2πn that x may be; None if these are too many."""
    if not abs(x) < MOST_ANGLE:
        return None
    turns = range(-MOST_TURNS, MOST_TURNS + 1)
    return [t for n in turns if (t := theta + 2 * n * arb.pi()).overlaps(x)]
