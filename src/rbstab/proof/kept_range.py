"""Energies below which a soft guard of θ2 keeps every motion in the range: theorem 11.

A guard adds g(θ2), which is zero up to its soft angle and never falls beyond it. f is the reduced
energy of all the rest, so U = f + g. A motion that starts with |θ2| < π/2 and has less energy than
the least U on θ2 = ±π/2 cannot get there. This needs no rest state. Where the motion goes then
follows from the rest states of f, if the guard adds none.
"""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rbstab.elements.guards.soft_guards import SoftGuard
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import PITCH
from rbstab.proof.boxes import Box, joined
from rbstab.proof.confine import confined, end_of_pitch
from rbstab.proof.enclosures.bounds import BoundedEnergy
from rbstab.proof.enclosures.intervals import Intervals
from rbstab.proof.enclosures.levels import Ranges, least_values
from rbstab.proof.exact.expr import Expr, expr, variable
from rbstab.proof.model import RANGE_END, Energy
from rbstab.proof.record import FORMAT, Record, energy_record
from rbstab.proof.regions.landscape import open_faces
from rbstab.proof.search import Search

LIMIT = 60_000
"""Boxes beyond the soft angle at which the search stops."""

AROUND = 2e-6
"""rad: more than the checker leaves out about what is undecided."""

MAX_END = 90.0
"""rad: wider ranges of θ1 and θ3 are not searched, because they take too long."""


@dataclass(frozen=True, eq=False)
class Border:
    """The least energy f at the ends of the range, for all real θ1 and θ3.

    Args:
        end: The largest |Θ| of a box that contains the lowest points of both ends and all rest
            states, shape (3,), rad.
        energy: A proved lower bound of f on θ2 = ±π/2, J.
    """

    end: Array
    energy: float


def border_of_pitch(energy: Energy) -> Border | None:
    """Bound f from below on θ2 = ±π/2, for all real θ1 and θ3.

    f grows beyond all bounds with |θ1| and |θ3|, so it has a lowest point on each end. There
    ∂f/∂θ1 = ∂f/∂θ3 = 0, so theorem 6 bounds |θ1| and |θ3| of that point as well.

    Args:
        energy: f; nothing keeps a motion away from θ2 = ±π/2.

    Returns:
        The bound; None if θ1 and θ3 have none that is small enough for a search.
    """
    V = Ranges.of(energy)
    outer = confined(energy, V.V)
    if outer is None or not np.all(outer < MAX_END):
        return None
    end = np.array([outer[0], end_of_pitch(energy), outer[1]])
    faces = joined([boxes for _, boxes in open_faces(Box(-end, end), [PITCH])], 3)
    return Border(end, float(least_values(V, faces).bound.min()))


def guard_energy(kind: type[SoftGuard], strength: float, soft_angle: float) -> Expr:
    """Return g(θ2), J, with steps of its event functions.

    Args:
        kind: The class of the guard; the first of its gains is its strength, k or K.
        strength: k, N m/rad, or K, N m: the decimal that this double means.
        soft_angle: θ_s, rad, likewise.
    """
    theta2 = variable(PITCH)
    gains: dict[str, Any] = {kind.gains[0].name: expr(strength), "soft_angle": expr(soft_angle)}
    events = kind(name="guard", **gains).beyond(theta2)
    steps = [event.step(1 if kind.kinked else 2) for event in events]
    return expr(kind(name="guard", mode=np.array(steps, dtype=object), **gains).energy(theta2))


def energy_bound(border: Border, guard: Expr) -> float:
    """Return a proved lower bound of U on θ2 = ±π/2, J: f there, and what the guard adds."""
    end = RANGE_END[PITCH]
    added = float(_range(guard, np.nextafter(end, 0.0), end).lo[0])
    return math.nextafter(border.energy + added, -math.inf)


def energy_at_most(guard: Expr, pitch: float) -> float:
    """Return an upper bound of the guard's energy for all |θ2| up to an angle, J: that there."""
    return float(_range(guard, pitch, pitch).hi[0])


def _range(guard: Expr, low: float, high: float) -> Intervals:
    """Return bounds on g between two angles θ2, J."""
    return BoundedEnergy(guard, (PITCH,)).over(np.array([[low]]), np.array([[high]])).value_over


@np.errstate(all="ignore")  # comparisons with NaN are false
def nothing_rests_beyond(energy: Energy, border: Border, guard: Expr, soft_angle: float) -> bool:
    """Return whether no rest state with θ_s <= |θ2| <= π/2 is possible, proved box by box.

    At θ_s itself the couple of a repelling guard may be any between 0 and K (Filippov): over a box
    with this angle its step is any number from 0 to 1, and so is the share of K in the gradient.

    Args:
        energy: f.
        border: Its ends; beyond them nothing is at rest (theorem 6).
        guard: g.
        soft_angle: θ_s, rad.
    """
    U = BoundedEnergy(energy.U + guard, free=energy.free, least=energy.least)
    (first, end, third), begin = border.end, math.nextafter(soft_angle, 0.0)
    for low, high in ((begin, end), (-end, -begin)):
        slab = Box(np.array([-first, low, -third]), np.array([first, high, third]))
        zeros = Search(U, slab).run(LIMIT)
        if not zeros.proved or zeros.zeros:
            return False
    return True


def kept_record(
    energy: Energy, border: Border, guard: Expr, energy_bound: float, inner: float
) -> Record:
    """Return a record for the checker, of what theorem 11 claims.

    Args:
        energy: f.
        border: Its ends.
        guard: g.
        energy_bound: Motions with less energy keep the range, J.
        inner: Where no rest state is claimed, |θ2| is larger, rad.
    """
    U = energy.U if energy.plain is None else energy.plain
    (first, _, third), pitch = border.end.tolist(), inner - AROUND
    claims = {
        "end": [first, "pi/2", third],
        "everywhere": True,
        "kept": energy_bound,
        "complete": False,
        "states": [],
        "undecided": [[[-first, -pitch, -third], [first, pitch, third]]],
    }
    guarded = replace(energy, U=U + guard, plain=None)
    return {"format": FORMAT, "energy": energy_record(guarded), "ranges": [claims]}
