"""Motions to many digits, by a method that shares nothing with the proofs of motions.

Gragg's midpoint rule and extrapolation in the step (Bulirsch and Stoer), in 220 bits. The proofs
use Taylor models in doubles. Both take the equations from the project.
"""

import numpy as np
from flint import arb, ctx

from rbstab.systems.modes import guards_at, with_modes

BITS = 220
COLUMNS = 14
"""The order of the extrapolation is twice this."""


def middles(values):
    """Return numbers without their errors, as exact balls."""
    middle = np.empty(len(values), dtype=object)
    for index, value in enumerate(values):
        middle[index] = (value if isinstance(value, arb) else arb(value)).mid()
    return middle


def state_after(system, y, step):
    """Return the state a step later; the step must be short."""
    with ctx.workprec(BITS):
        state, change = _extrapolated(system.rates, y, arb(step))
    assert change < 1e-25
    return state


def state_through(system, y, step):
    """Return the state a step later of a motion that may switch, and the number of switches.

    The times of the switches are found by Newton's method, and each begins a new step.
    """
    crossings = 0
    with ctx.workprec(BITS):
        left, tiny, g = arb(step), arb(2) ** -80, guards_at(system, y)
        modes, piece = [float(guard > 0) for guard in g], arb(step)
        while left > 0:
            system = with_modes(system, tuple(modes))
            piece = piece if piece < left else left
            end, change = _extrapolated(system.rates, y, piece)
            if not change < 1e-25:
                piece = piece / 2
                continue
            changed = [k for k, g in enumerate(guards_at(system, end)) if float(g > 0) != modes[k]]
            if not changed:
                y, left = end, (left - piece).mid()
            elif len(changed) > 1:
                piece = piece / 2
            else:
                (k,), t = changed, piece / 2
                there, _ = _extrapolated(system.rates, y, t)
                while abs((g := guards_at(system, there)[k]).mid()) > 1e-28:
                    ahead = middles(there + tiny * system.rates(there))
                    t = (t - g * tiny / (guards_at(system, ahead)[k] - g)).mid()
                    there, _ = _extrapolated(system.rates, y, t)
                modes[k], crossings = 1.0 - modes[k], crossings + 1
                y, left, piece = there, (left - t).mid(), left
        return y, crossings


def _extrapolated(rates, y, step):
    rows: list[list[np.ndarray]] = []
    for j in range(1, COLUMNS + 1):
        row = [_midpoint_rule(rates, y, step, 2 * j)]
        for k in range(1, j):
            ratio = arb(j) / (j - k)
            change = (row[-1] - rows[-1][k - 1]) / (ratio * ratio - 1)
            row.append(middles(row[-1] + change))
        rows.append(row)
    change = max(abs(float(x)) for x in rows[-1][-1] - rows[-1][-2])
    return rows[-1][-1], change


def _midpoint_rule(rates, y, step, count):
    h = step / count
    before, now = y, middles(y + h * rates(y))
    for _ in range(count - 1):
        before, now = now, middles(before + 2 * h * rates(now))
    return middles((before + now + h * rates(now)) / 2)
