"""All rest states of an energy on SO(3), by the search for zeros in four charts.

The closed cubes of the charts cover SO(3). A zero near the border of one is found in several, and
proved to be the same, or another. Nothing is left out: a box of a chart is done only if it has no
zero, or lies where a proved zero, which may be beyond the border, is the only one.
"""

import numpy as np

from rbstab.analysis.rest_state import in_order
from rbstab.mechanics.numbers import Array
from rbstab.proof.boxes import Box, as_boxes
from rbstab.proof.enclosures.bounds import BoundedEnergy
from rbstab.proof.enclosures.intervals import Intervals, power, product
from rbstab.proof.rotations.energy import RotationEnergy
from rbstab.proof.rotations.forms import in_chart
from rbstab.proof.rotations.states import FAMILY, RestRotation, Rotations, against_morse
from rbstab.proof.search import Search
from rbstab.proof.zeros import Zero

CHARTS = range(4)

END = np.full(3, np.nextafter(1.0, 2.0))
"""The end of the cube of a chart: no rotation has its largest entry outside of all four."""

BOX_LIMIT = "the limit on the number of boxes was reached"

SMALL_PARTS = "in small parts it could not be decided whether there is a rest state"


def searched_states(energy: RotationEnergy, limit: int) -> Rotations:
    """Return the rest states of an energy on SO(3).

    Args:
        energy: The energy.
        limit: The largest number of boxes in each chart.
    """
    states, examined, why, share = list[RestRotation](), 0, "", 0.0
    for k in CHARTS:
        V = BoundedEnergy(in_chart(energy.U, k), free=energy.free)
        zeros = Search(V, Box(-END, END), across=True).run(limit)
        examined += zeros.examined
        share += zeros.share / len(CHARTS)
        if zeros.family:
            return Rotations(tuple(states), examined, FAMILY, share=share)
        if not zeros.proved:
            why = BOX_LIMIT if zeros.stopped else SMALL_PARTS
            return Rotations(tuple(states), examined, why, share=share)
        for zero in zeros.zeros:
            state = _state(V, zero, k)
            if state is None:
                why = why or "whether a rest state is stable could not be decided"
                continue
            verdicts = [same(state, other) for other in states]
            if None in verdicts:
                why = why or "whether two rest states are the same could not be decided"
            if True not in verdicts:
                states.append(state)
    why = why or against_morse([state.index for state in states])
    order = tuple(in_order(states, lambda state: (state.energy, state.quaternion)))
    return Rotations(order, examined, why, share=share)


def _state(V: BoundedEnergy, zero: Zero, k: int) -> RestRotation | None:
    """Return a zero of a chart as a rest state; None if its index is not proved."""
    if zero.index is None:
        return None
    low, high = zero.enclosure
    value = V.over(low[:, None], high[:, None]).value_over
    q = np.insert(zero.point, k, 1.0)
    # To put a vector with |q| >= 1 on the unit sphere brings no two of them farther apart.
    away = np.maximum(high - zero.point, zero.point - low)
    radius = float(np.linalg.norm(away)) * (1 + 1e-12) + 1e-15
    unit = q / np.linalg.norm(q)
    return RestRotation(unit, radius, zero.index, float(value.lo[0]), float(value.hi[0]), k, zero)


def same(first: RestRotation, second: RestRotation) -> bool | None:
    """Return whether two zeros of charts are the same rest state, if that is proved; else None.

    With a_k = 1 and b_j = 1 they are the same only if a b_k = b. They are the same if the enclosure
    of one, seen in the chart of the other, lies where the other is the only zero.
    """
    a, b = _corners(first), _corners(second)
    scaled, exact = Intervals.of(product(a, b[first.chart])), Intervals.of(b)
    if np.any((scaled.hi < exact.lo) | (scaled.lo > exact.hi)):
        return False
    for q, other in ((a, second), (b, first)):
        seen = product(q, power(q[other.chart], -1))  # without ends if the divisor may be zero
        lo, hi = np.delete(seen[..., 0], other.chart, 0).T
        if as_boxes(Box(lo, hi)).within(_zero_of(other).domain)[0]:
            return True
    return None


def _corners(state: RestRotation) -> Array:
    """Return the enclosure of a zero as intervals of q, shape (4, 2, 1)."""
    ends = np.stack(_zero_of(state).enclosure, 1)[..., None]
    return np.insert(ends, state.chart, 1.0, axis=0)


def _zero_of(state: RestRotation) -> Zero:
    assert state.zero is not None
    return state.zero
