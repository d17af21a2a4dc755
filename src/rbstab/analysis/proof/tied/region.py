"""The region of a tied body with springs in which W proves convergence: a lower bound of c*.

c* is the least W on the border of the range of Θ, over all z, at all rest states but the lowest,
and where a line has no length. All of these places are divided into boxes at once, until a bound
on W is close to the least value that was seen.

On the border the least W over z has ∂W/∂z = 0, as z is free and each w_j is negative, so that no
lowest point has a line without length. With the centre m of a box and such a point y in it,
expanded about y: W(m) = W(y) - ∂W/∂Θ(y)'δ + ½ δ'Hδ, δ = y - m without entries of z in the first
term. So W(y) >= W(m) - |∂W/∂Θ| r_Θ - ½ |H| r r.
"""

from dataclasses import dataclass, replace

import numpy as np

from rbstab.analysis.proof.boxes import Boxes, joined
from rbstab.analysis.proof.certified_region import Face
from rbstab.analysis.proof.formulas import jets
from rbstab.analysis.proof.lines.intervals import ROUNDING, Intervals
from rbstab.analysis.proof.outcome import SearchOutcome
from rbstab.analysis.proof.tied.bounds import ANGLES, SHIFT, Bounds, Forms, Pose
from rbstab.analysis.proof.tied.energy import TiedEnergy
from rbstab.analysis.proof.tied.extent import scale_of
from rbstab.analysis.proof.tied.search import TiedZero, TiedZeros, narrowed, part
from rbstab.analysis.proof.tied.seen import energies
from rbstab.mechanics.numbers import Array

BATCH = 512
BOX_LIMIT = 300_000
"""The number of boxes at which the search stops; then there is no region."""

SLACK, SLACK_OF_FORMULAS = 1e-3, 3e-3
"""The bound may be below c* by this part of its height above the lowest rest state; boxes take
longer with energies of elements of users."""

STEP = 1e-6
"""rad: the step of differences."""

DIFFERENCES = STEP * np.concatenate([np.zeros((1, 3)), np.eye(3), -np.eye(3)])

SAMPLES = 400
"""The number of points on each face and each set without length from which c* is estimated."""


@dataclass(frozen=True, eq=False)
class TiedRegion:
    """Every motion with E < energy_bound, from the range, converges to the lowest rest state.

    energy is c*, J, to round-off of a search, attained at the angles `attained_at`: on `face`, or
    where the line with the index `line` has no length, or else at another rest state.
    energy_bound is proved; None: not proved. lower_bound is a proved lower bound of its height
    above the lowest rest state, J, or 0. examined is the number of boxes.
    """

    energy: float
    energy_bound: float | None
    lower_bound: float
    attained_at: Array
    face: Face | None
    line: int | None
    examined: int


@dataclass(frozen=True, eq=False)
class Place:
    """A part of the border of {W < c}: a face of the range, or where a line has no length."""

    Theta: Boxes
    face: Face | None = None
    line: int | None = None


def tied_region(
    energy: TiedEnergy, found: TiedZeros, end: Array, box_limit: int = BOX_LIMIT
) -> TiedRegion | None:
    """Compute a lower bound of c*.

    It is None if the lowest rest state is no proved minimum, or if the search for rest states ended
    early, with undecided boxes that may be lower.

    Args:
        energy: W.
        found: The zeros of ∇W with -end <= Θ <= end.
        end: The largest |Θ|, shape (3,), rad.
        box_limit: The number of boxes at which the search stops.
    """
    ordered = sorted(found.zeros, key=lambda zero: float(value_at(energy, zero.y).middle[0]))
    if not ordered or ordered[0].index != 0:
        return None
    lowest, *others = ordered
    places = [Place(face.box_of(end), face=face) for face in Face]
    whole = Boxes(-end[np.newaxis], end[np.newaxis])
    places += [Place(whole, line=k) for k in range(len(energy.lines))]
    with np.errstate(all="ignore"):
        seen = _seen(energy, places, others)
        height = value_at(energy, lowest.y).high[0]
        bound = _inside_bound(energy, found, others)
        if found.outcome is SearchOutcome.BOX_LIMIT and (bound is None or bound <= height):
            return None  # undecided boxes are too near
        examined = 0
        slack = SLACK_OF_FORMULAS if energy.formulas else SLACK
        target = seen.energy - slack * max(seen.energy - height, 0.0)
        for place in places:
            if bound is None:
                break
            at_place, more = _least(energy, place, target, box_limit - examined)
            examined += more
            bound = None if at_place is None else min(bound, at_place)
    above = 0.0 if bound is None else max(0.0, float(np.nextafter(bound - height, -np.inf)))
    return replace(seen, energy_bound=bound, lower_bound=above, examined=examined)


def value_at(energy: TiedEnergy, y: Array) -> Intervals:
    """Return W at a point [Θ, z], shape (1,)."""
    point = Boxes(y[np.newaxis, ANGLES], y[np.newaxis, ANGLES])
    return Pose(energy, point).at(y[np.newaxis, SHIFT]).value


def _inside_bound(energy: TiedEnergy, found: TiedZeros, others: list[TiedZero]) -> float | None:
    """Bound W from below at the other rest states and in undecided boxes; None without a bound."""
    boxes = joined([found.undecided, *(zero.enclosure for zero in others)])
    if not len(boxes):
        return np.inf
    pose = Pose(energy, part(boxes, ANGLES))
    least = float(pose.within(part(boxes, SHIFT)).value.low.min())
    return least if np.isfinite(least) else None


def _least(
    energy: TiedEnergy, place: Place, target: float, box_limit: int
) -> tuple[float | None, int]:
    """Bound W from below at a place; None if it is not proved to be at least the target."""
    pending, bound, examined = _start(energy, place), np.inf, 0
    while len(pending):
        batch, pending = pending[-BATCH:], pending[:-BATCH]
        examined += len(batch)
        if examined > box_limit:
            return None, examined
        if place.line is None:
            batch, lower = _on_face(energy, batch)
        else:
            lower = _without_length(energy, place.line, batch)
        finished = lower >= target
        bound = min(bound, float(lower[finished].min(initial=np.inf)))
        left = batch[~finished]
        if np.any(left.radius.max(axis=1) < 1e-9):
            return None, examined
        scale = scale_of(energy)[: left.low.shape[1]]
        pending = joined([pending, left.halves((left.radius / scale).argmax(axis=1))])
    return bound, examined


def _start(energy: TiedEnergy, place: Place) -> Boxes:
    if place.face is None:
        return place.Theta
    z = scale_of(energy)[np.newaxis, SHIFT]
    low, high = np.hstack([place.Theta.low, -z]), np.hstack([place.Theta.high, z])
    return Boxes(low, high)


def _on_face(energy: TiedEnergy, boxes: Boxes) -> tuple[Boxes, Array]:
    """Bound W from below where ∂W/∂z = 0; boxes without such a point have no bound to keep."""
    pose = Pose(energy, part(boxes, ANGLES))
    boxes, left = narrowed(pose, boxes, angles=False)
    boxes, pose = boxes[left], pose[left]
    z = part(boxes, SHIFT)
    at_centre, over = pose.at(z.centre).value, pose.within(z)
    r, size = boxes.radius, over.hessian.size
    slope = np.einsum("mi,mi->m", over.gradient.size[:, ANGLES], r[:, ANGLES])
    bend = 0.5 * np.einsum("mij,mi,mj->m", size, r, r)
    expanded = at_centre.low - (slope + bend) * (1 + 20 * ROUNDING)
    return boxes, _larger(expanded, over.value.low)


def _without_length(energy: TiedEnergy, line: int, boxes: Boxes) -> Array:
    """Bound W from below where a line has no length, so that z = -r(Θ)."""
    pose = Pose(energy, boxes)
    over, centre = (_with_z(pose, orders, line) for orders in (pose.over, pose.at_centre))
    slopes = pose.slopes(line)
    pulled = (over.pulled + over.force)[:, :, np.newaxis]
    gradient = over.form[1] + -((pulled * slopes).sum(1))
    for other in over.lines:
        gradient = gradient + other.moment
    for formula in over.formulas:
        gradient = gradient + jets.gradient(formula)[:, ANGLES]
    slope = np.einsum("mi,mi->m", gradient.size, boxes.radius) * (1 + 20 * ROUNDING)
    return _larger(centre.value.low - slope, over.value.low)


def _with_z(pose: Pose, orders: Forms, line: int) -> Bounds:
    """Return bounds with z = -r of a line, which is left out: its length is 0."""
    bounds = pose.of(orders, -pose.offset(orders, line))
    return replace(bounds, lines=[one for k, one in enumerate(bounds.lines) if k != line])


def _larger(one: Array, other: Array) -> Array:
    """Return the larger of two lower bounds; -inf where both are no number."""
    found = np.fmax(one, other)
    return np.where(np.isnan(found), -np.inf, found)


def _seen(energy: TiedEnergy, places: list[Place], others: list[TiedZero]) -> TiedRegion:
    """Return c* as a search sees it."""
    from scipy.optimize import minimize  # imported late, as in `least_value`

    rng = np.random.default_rng(0)
    best: list[tuple[float, Array, Face | None, int | None]]
    best = [(float(value_at(energy, one.y).middle[0]), one.y[ANGLES], None, None) for one in others]
    for place in places:
        low, high = place.Theta.low[0], place.Theta.high[0]

        def least(Theta: Array, place: Place = place) -> tuple[float, Array]:
            """Return the energy and its slopes by differences, all from one evaluation."""
            values = energies(energy, place.line, Theta + DIFFERENCES)
            return float(values[0]), (values[1:4] - values[4:]) / (2 * STEP)

        samples = rng.uniform(low, high, size=(SAMPLES, 3))
        for start in samples[np.argsort(energies(energy, place.line, samples))[:3]]:
            bounds = list(zip(low, high, strict=True))
            found = minimize(least, start, jac=True, bounds=bounds, method="L-BFGS-B")
            best.append((float(found.fun), found.x, place.face, place.line))
    value, Theta, face, line = min(best, key=lambda one: one[0])
    return TiedRegion(value, None, 0.0, Theta, face, line, 0)
