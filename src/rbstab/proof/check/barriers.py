"""Barriers: near the end of an angle U rises to infinity, so nothing is at rest there.

U has powers of 1/d, with d = cos θ2, or d = cos ½θ for the other angles. With U = Σ B_k d^-k,

    d^(N+1) ∂U/∂θ = Σ_k (d ∂B_k/∂θ - k B_k ∂d/∂θ) d^(N-k)

has bounds also where d reaches 0. Where it is positive toward the end, and B_N there, U rises to
infinity. To set the angle back to where this begins never raises U.
"""

from collections.abc import Mapping
from functools import partial
from typing import NamedTuple

from flint import arb

from rbstab.proof.check.bounds import centre_and_steps
from rbstab.proof.check.cover import cover
from rbstab.proof.check.energy import Energy
from rbstab.proof.check.findings import Box, Cover
from rbstab.proof.check.least import minimiser_over
from rbstab.proof.check.taylor import Ball, coefficients, whole_power

GAPS = [2.0**-k for k in range(1, 28)]
"""rad: distances from the end that are tried, the longest first."""

LIMIT = 300
"""Boxes of one trial."""

Dual = tuple[Ball | None, Ball | None]
"""A value and its slope along the angle; None for zero."""

Laurent = dict[int, Dual]
"""Σ_k B_k d^-k: each B_k with its slope."""


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
    number = _number_of_pole(U, axis)
    if number is None:
        return None, {}
    for gap in GAPS:
        begin = float((end - gap).mid())
        # Where θ is nearer to the end than `begin`, 0 <= d <= d(begin).
        most = (arb(begin) * _share(axis)).cos()
        pole, covers = _Pole(axis, number, arb(most.upper() / 2, most.upper() / 2)), {}
        for side in (-1, 1):
            part = (begin, box[axis][1]) if side > 0 else (box[axis][0], -begin)
            slab = (*box[:axis], part, *box[axis + 1 :])
            reason = partial(_rises, U, pole, side)
            covers[f"θ{axis + 1} near {side * float(end.mid()):.6g}"] = cover(slab, reason, LIMIT)
        if all(found.open is None for found in covers.values()):
            return begin, covers
    return None, {}


class _Pole(NamedTuple):
    """d: the axis of its angle, the operation that it is, and its range."""

    axis: int
    number: int
    d: Ball


def _share(axis: int) -> Ball:
    """Return c of d = cos cθ."""
    return arb(1) if axis == 1 else arb(0.5)


def _number_of_pole(U: Energy, axis: int) -> int | None:
    """Return the operation that is d."""
    for k, (kind, *rest) in enumerate(U.operations):
        if kind != "cos":
            continue
        inner = U.operations[rest[0]]
        if axis != 1 and inner[0] == "sum" and inner[1] == 0 and len(inner[2]) == 1:
            ((factor, of),) = inner[2]
            inner = U.operations[of] if factor * 2 == 1 else inner
        elif axis != 1:
            continue
        if inner == ("var", axis):
            return k
    return None


def _rises(U: Energy, pole: _Pole, side: int, box: Box) -> str | None:
    """Return "r" if U rises towards the end of an angle on all of a box, or None."""
    middle, steps = centre_and_steps(box)
    values = [m + d for m, d in zip(middle, steps, strict=True)]
    share = _share(pole.axis)
    slope, d = -share * (share * values[pole.axis]).sin(), pole.d
    if U.free:
        values += minimiser_over(U, box)
    found = _expanded(U, pole, values, (d, slope))
    last = max(found, default=0) if found is not None else 0
    if found is None or last < 1:
        return None
    top, total = found[last][0], arb(0)
    for k, (value, change) in found.items():
        if change is not None:
            total += change * whole_power(d, last + 1 - k)
        if value is not None and k:
            total -= k * value * slope * whole_power(d, last - k)
    return "r" if side * total > 0 and top is not None and top > 0 else None


def _expanded(U: Energy, pole: _Pole, values: list[Ball], d: Dual) -> Laurent | None:
    """Return U by powers of 1/d; None if it has no such form."""
    found = list[Laurent]()
    for k, (kind, *rest) in enumerate(U.operations):
        if k == pole.number:
            x: Laurent = {0: d}
        elif kind == "var":
            x = {0: (values[U.variables.index(rest[0])], arb(1) if rest[0] == pole.axis else None)}
        elif kind == "sum":
            x = {0: (arb(rest[0]), None)}
            for c, j in rest[1]:
                for n, (v, s) in found[j].items():
                    a, b = x.get(n, (None, None))
                    x[n] = _plus(a, _times(arb(c), v)), _plus(b, _times(arb(c), s))
        elif kind == "times":
            x = _product(found[rest[0]], found[rest[1]])
        elif kind == "pow" and rest[1] == pole.number and rest[0] < 0:
            x = {-rest[0]: (arb(1), None)}
        elif kind in ("step", "positive") or set(found[rest[-1]]) != {0}:
            return None
        else:
            v, s = found[rest[-1]][0]
            g = coefficients(kind, arb(0) if v is None else v, rest[0] if kind == "pow" else 0)
            x = {0: (g[0], _times(g[1], s))}
        found.append(x)
    return found[-1]


def _product(x: Laurent, y: Laurent) -> Laurent:
    found: Laurent = {}
    for i, (v, s) in x.items():
        for j, (w, t) in y.items():
            a, b = found.get(i + j, (None, None))
            slope = _plus(_times(v, t), _times(s, w))
            found[i + j] = _plus(a, _times(v, w)), _plus(b, slope)
    return found


def _plus(x: Ball | None, y: Ball | None) -> Ball | None:
    return y if x is None else x if y is None else x + y


def _times(x: Ball | None, y: Ball | None) -> Ball | None:
    return None if x is None or y is None else x * y
