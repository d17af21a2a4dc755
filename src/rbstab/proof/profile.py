"""The energy along θ2, at its least over θ1 and θ3: a computed curve for figures, not a proof."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rbstab.analysis.descents.descent import descend
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import PITCH
from rbstab.proof.confine import OUTER
from rbstab.proof.enclosures.bounds import BoundedEnergy
from rbstab.proof.enclosures.taylor import values_at
from rbstab.proof.exact.expr import Expr, only
from rbstab.proof.model import COSINE, HALVES, Energy

SPACING = 0.5
"""rad: between points of θ1, and of θ3, from which the lowest one is taken for each θ2."""

MOST_POINTS = 25
"""The most points of each of them."""

WIDEST = 15.0
"""rad: the grid ends here, also where the least energy may lie beyond."""

INNER = 3.1
"""rad: barriers on θ1 and θ3 keep them within ±π; the grid ends before."""

TOLERANCE = 1e-9
"""N m: the slope at which a descent from the lowest point of the grid ends."""

BATCH = 8192
"""Points that are evaluated at once."""

POLES = frozenset({COSINE, *HALVES.values()})
"""What is zero at the ends that barriers close: cos θ2, and the cosines of half the others."""


def without_barriers(energy: Energy) -> Energy:
    """Return the energy without ½ k tan² θ2 and ½ k tan²(θ/2), which are ½ k (1/cos² - 1)."""
    U, closed = energy.U, frozenset({PITCH} if energy.stop is not None else ())
    for m, c in energy.U.terms.items():
        if len(m) == 1 and m[0][0] in POLES and m[0][1] == -2:
            U = U - (only(m[0][0]) ** -2 - 1).scaled(c)
    return replace(energy, U=U, closed=closed)


@np.errstate(all="ignore")  # at ±π/2 the energy of a barrier is infinite
def least_along_pitch(energy: Energy, pitch: Array, end: Array) -> Array:
    """Return the least U over all real θ1 and θ3 for each θ2, J; infinite beyond a stop.

    Args:
        energy: U.
        pitch: θ2, shape (m,), rad, between -π/2 and π/2.
        end: The largest |Θ| of a box that contains the lowest points, shape (3,), rad (theorem 6).
    """
    most = np.minimum(end, INNER if energy.closed & set(OUTER) else WIDEST)
    lines = [_line(float(most[axis])) for axis in OUTER]
    grid = np.stack(np.meshgrid(pitch, *lines, indexing="ij"))[[1, 0, 2]]
    lowest = _values(energy.U, grid.reshape(3, -1)).reshape(len(pitch), -1).argmin(axis=1)
    Theta = grid.reshape(3, len(pitch), -1)[:, np.arange(len(pitch)), lowest]
    V = BoundedEnergy(energy.U, free=energy.free, least=energy.least, order=2)
    least = _descended(V, Theta)
    stop = np.inf if energy.stop is None else float(energy.stop)
    return np.where(np.abs(pitch) <= stop, least, np.inf)


def _line(end: float) -> Array:
    return np.linspace(-end, end, min(MOST_POINTS, 1 + 2 * int(np.ceil(end / SPACING))))


def _values(U: Expr, Theta: Array) -> Array:
    """Return U at points, J, with 0 for all variables but Θ: U is near its least there."""
    q = np.zeros((1 + max(U.variables | {2}), Theta.shape[1]))
    q[:3] = Theta
    parts = [values_at(U, q[:, k : k + BATCH]) for k in range(0, Theta.shape[1], BATCH)]
    return np.concatenate(parts)


class _AtAngles(NamedTuple):
    """Energies with their derivatives by θ1 and θ3 at m points, an `EnergyAt`."""

    value: Array
    gradient: Array
    hessian: Array


def _descended(V: BoundedEnergy, Theta: Array) -> Array:
    """Return the values at the ends of descents in θ1 and θ3 from points, shape (m,)."""
    places = list(OUTER)

    def energy(rows: Array, outer: Array) -> _AtAngles:
        at = Theta[:, rows]
        at[places] = outer
        value, gradient, hessian = V.at(at)
        block = np.moveaxis(hessian[np.ix_(places, places)], 2, 0)
        return _AtAngles(value, gradient[places].T, block)

    _, least, _ = descend(energy, Theta[places], np.full(Theta.shape[1], TOLERANCE))
    return least
