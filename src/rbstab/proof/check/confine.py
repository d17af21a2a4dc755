"""All rest states with any real θ1 and θ3 lie in a range: theorem 6 of docs/proofs.md.

With U = ½ Θ'KΘ + q'Θ + p(Θ), p periodic in θ1 and θ3, and the block k of K for these, at rest

    [θ1, θ3] = -k⁻¹ [q_j + K_j2 θ2 + ∂p/∂θ_j],    j in {1, 3}.

The right-hand side is bounded on a cover of one period. In each box, the whole turns that may be
added to θ1 and θ3 are those with which they meet their right-hand sides.
"""

import math

from flint import arb, arb_mat

from rbstab.proof.check.cover import cover
from rbstab.proof.check.energy import Energy, operands, variables_of
from rbstab.proof.check.findings import Box, Cover
from rbstab.proof.check.least import bounds
from rbstab.proof.check.ranges import Range
from rbstab.proof.check.taylor import Ball

OUTER = (0, 2)

MOST_ANGLE = 100
"""rad: where the right-hand side may be larger, a box is halved."""

MOST_TURNS = 17
"""More than `MOST_ANGLE` and a period."""

PERIOD = 3.1416
"""rad: more than π."""


class Parts:
    """U taken apart: K, q and the periodic rest; `ok` says whether it could be."""

    def __init__(self, U: Energy) -> None:
        self.K = [[arb(0)] * U.n for _ in range(U.n)]
        self.q = [arb(0)] * U.n
        kind, c0, terms = U.operations[-1]
        assert kind == "sum"
        left = []
        for c, k in terms:
            factors = variables_of(U, k)
            if factors is None or len(factors) > 2 or max(factors) > 2:
                # What depends on θ2 alone has no slope along the others.
                left += [] if U.depends[k] == {1} else [(c, k)]
            elif len(factors) == 1:
                self.q[factors[0]] += arb(c)
            else:
                i, j = factors
                self.K[i][j] += arb(c)
                self.K[j][i] += arb(c)
        self.periodic = U.with_operations([*U.operations[:-1], (kind, c0, left)])
        self.ok = _is_periodic(self.periodic)


def _is_periodic(U: Energy) -> bool:
    """Return whether θ1 and θ3 stand in sines and cosines alone, in what U uses."""
    used, pending = set[int](), [len(U.operations) - 1]
    while pending:
        k = pending.pop()
        if k in used:
            continue
        used.add(k)
        one = U.operations[k]
        if one[0] == "var" and one[1] in OUTER:
            return False
        of_variable = one[0] in ("sin", "cos") and U.operations[one[1]][0] == "var"
        pending += [] if of_variable else operands(one)
    return True


def confined(U: Energy, range_: Range) -> Cover | None:
    """Cover a period by boxes that show that all rest states have |θ1| < e1 and |θ3| < e3.

    Returns:
        The cover; None if U has another form, or k is not definite.
    """
    parts = Parts(U)
    K = parts.K
    k = arb_mat([[K[i][j] for j in OUTER] for i in OUTER])
    if not (parts.ok and k[0, 0] > 0 and k.det() > 0):
        return None
    inverse = k.inv()
    ends = [range_.ends[i] for i in OUTER]

    def reason(box: Box) -> str | None:
        over = bounds(parts.periodic, box)
        theta2 = over.middle[1] + over.steps[1]
        slopes = [over.slopes[j] for j in OUTER]
        load = [parts.q[j] + K[j][1] * theta2 + s for j, s in zip(OUTER, slopes, strict=True)]
        possible = []
        for i in (0, 1):
            x = sum((inverse[i, j] * load[j] for j in (0, 1)), arb(0))
            theta = over.middle[OUTER[i]] + over.steps[OUTER[i]]
            possible.append(_turns(theta, x))
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
