"""Energies below which a soft guard of θ2 keeps every motion in the range: theorem 11.

A guard adds g(θ2), which is zero up to its soft angle and never falls beyond it. f is the reduced
energy of all the rest, so U = f + g. A motion that starts with |θ2| < π/2 and has less energy than
the least U on θ2 = ±π/2 cannot get there. This needs no rest state. Where the motion goes then
follows from the rest states of f, if the guard adds none.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from rbstab.analysis.exact import decimal_balls, in_balls, upper
from rbstab.analysis.proof.boxes import RANGE_END, Boxes, joined
from rbstab.analysis.proof.face import Face
from rbstab.analysis.proof.enclosure import enclosure
from rbstab.analysis.proof.least_value import least_value
from rbstab.analysis.proof.trigonometric import TrigonometricForm
from rbstab.analysis.proof.unwrapped import unwrapped_end
from rbstab.elements.guards.soft_guards import SoftGuard
from rbstab.mechanics.numbers import Array

BATCH = 2048

FACE_BOX_LIMIT = 100_000

BOX_LIMIT = 200_000
"""The number of boxes beyond the soft angle at which the search stops."""

MAX_END = 90.0
"""rad: wider ranges of θ1 and θ3 are not searched, because they take too long."""

MIN_RADIUS = 1e-5
"""rad: narrower boxes are not halved again: something is at rest there, or nearly so."""

INSIDE = np.zeros(2)
ABOVE = np.array([1.0, 0.0])
"""The modes of a guard for |θ2| <= θ_s, and for θ2 > θ_s."""

BallGuard = Callable[[Array], SoftGuard]
"""Returns a guard in balls, in the given modes; call it by `in_balls`."""


@dataclass(frozen=True, eq=False)
class Border:
    """The least energy f at the ends of the range, for all real θ1 and θ3.

    Attributes:
        end: The largest |Θ| of a box that contains the lowest points of both ends and all rest
            states, shape (3,), rad.
        energy: A proved lower bound of f on θ2 = ±π/2, J.
    """

    end: Array
    energy: float


def border_of_pitch(form: TrigonometricForm) -> Border | None:
    """Bound f from below on θ2 = ±π/2, for all real θ1 and θ3.

    f grows beyond all bounds with |θ1| and |θ3|, so it has a lowest point on each end. There
    ∂f/∂θ1 = ∂f/∂θ3 = 0, so theorem 6 bounds |θ1| and |θ3| of that point as well.

    Returns:
        The bound; None if θ1 and θ3 have none that is small enough for a search.
    """
    end = unwrapped_end(form)
    if end is None or not np.all(end < MAX_END):
        return None
    wide = replace(form, reach=max(form.reach, float(end.max())))
    faces = [face.box_of(end) for face in (Face.THETA2_LOW, Face.THETA2_HIGH)]
    return Border(end, min(least_value(wide, box, FACE_BOX_LIMIT).lower_bound for box in faces))


def ball_guard(kind: type[SoftGuard], strength: float, soft_angle: float) -> BallGuard:
    """Return a guard whose numbers are the decimals that these doubles mean.

    Args:
        kind: Its class; the first of its gains is its strength, k or K.
        strength: k, N m/rad, or K, N m.
        soft_angle: θ_s, rad.
    """
    return partial(_guard_in_balls, kind, np.array([strength, soft_angle]))


def _guard_in_balls(kind: type[SoftGuard], numbers: Array, mode: Array) -> SoftGuard:
    strength, soft_angle = decimal_balls(numbers)
    gains = {kind.gains[0].name: strength, "soft_angle": soft_angle}
    return kind(name="guard", mode=mode, **gains)


def energy_bound(border: Border, guard: BallGuard) -> float:
    """Return a proved lower bound of U on θ2 = ±π/2, J: f there, and what the guard adds."""

    def bound() -> float:
        from flint import arb  # imported late, as in `polynomial`

        return -upper(-(arb(border.energy) + guard(ABOVE).energy(arb.pi() / 2)))

    return float(in_balls(bound))


def energy_at_most(guard: BallGuard, pitch: float) -> float:
    """Return an upper bound of the guard's energy for all |θ2| up to an angle, J."""

    def bound() -> float:
        from flint import arb  # imported late, as in `polynomial`

        angle = arb(pitch)
        reached = not angle <= guard(INSIDE).soft_angle
        return upper(arb(0) + guard(ABOVE if reached else INSIDE).energy(angle))

    return float(in_balls(bound))


@np.errstate(all="ignore")  # comparisons with NaN are false
def nothing_rests_beyond(
    form: TrigonometricForm, border: Border, guard: BallGuard, soft_angle: float
) -> bool:
    """Return whether no rest state with θ_s <= |θ2| <= π/2 is possible, proved box by box.

    In each box ∂f/∂θ1 or ∂f/∂θ3 has no zero, or ∂f/∂θ2 and the slope of the guard do not balance.
    At θ_s itself the couple of a repelling guard may be any between 0 and K (Filippov).

    Args:
        form: f.
        border: Its ends; beyond them nothing is at rest (theorem 6).
        guard: The guard.
        soft_angle: θ_s, rad.
    """
    wide = replace(form, reach=max(form.reach, float(border.end.max())))
    begin, end = math.nextafter(soft_angle, 0.0), float(RANGE_END[1])
    sides = [_slab(border.end, low, high) for low, high in ((begin, end), (-end, -begin))]
    pending, examined = joined(sides), 0
    while len(pending) and examined < BOX_LIMIT:
        batch, pending = pending[-BATCH:], pending[:-BATCH]
        examined += len(batch)
        low, high = enclosure(wide, batch).gradient_bounds
        added = _slope_bounds(guard, soft_angle, batch)
        low[:, 1] += added[0] - 1e-15 * (np.abs(low[:, 1]) + np.abs(added[0]))
        high[:, 1] += added[1] + 1e-15 * (np.abs(high[:, 1]) + np.abs(added[1]))
        left = batch[~np.any((low > 0) | (high < 0), axis=1)]
        if np.any(left.radius.max(axis=1, initial=0.0) < MIN_RADIUS):
            return False
        pending = joined([pending, left.halves(left.radius.argmax(axis=1))])
    return not len(pending)


def _slab(end: Array, low: float, high: float) -> Boxes:
    """Return the box of all Θ with θ2 between two angles."""
    return Boxes(np.array([[-end[0], low, -end[2]]]), np.array([[end[0], high, end[2]]]))


def _slope_bounds(guard: BallGuard, soft_angle: float, boxes: Boxes) -> tuple[Array, Array]:
    """Bound the slope of the guard by θ2 over boxes on one side of 0 each, shape (m,) each."""
    above = boxes.low[:, 1] > 0
    nearest = np.where(above, boxes.low[:, 1], -boxes.high[:, 1])
    farthest = np.where(above, boxes.high[:, 1], -boxes.low[:, 1])
    least = _slopes(guard, nearest)[0]
    least[nearest <= math.nextafter(soft_angle, math.inf)] = 0.0
    most = _slopes(guard, farthest)[1]
    return np.where(above, least, -most), np.where(above, most, -least)


def _slopes(guard: BallGuard, angles: Array) -> tuple[Array, Array]:
    """Return bounds on the slope at angles above θ_s, shape (m,) each."""
    different, places = np.unique(angles, return_inverse=True)

    def bounds() -> list[tuple[float, float]]:
        from flint import arb  # imported late, as in `polynomial`

        beyond = guard(ABOVE)
        slopes = [arb(0) + beyond.slope(arb(angle)) for angle in different.tolist()]
        return [(-upper(-slope), upper(slope)) for slope in slopes]

    table = np.array(in_balls(bounds))[places.reshape(-1)]
    return table[:, 0].copy(), table[:, 1]
