"""All rest states of a tied body in six variables, by branch and bound over Θ and z.

With springs alone z = -S⁻¹Σ w_j u_j at a rest state, with unit vectors u_j. So z is in a known box
(`extent`), and this equation narrows the part of it that belongs to a box of Θ; the forces of
ligaments and of elements of users are part of it. What is left is tested as in
`rbstab.proof.search`, in six variables.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from rbstab.analysis.proof.boxes import RANGE_END, Boxes, box_around, joined
from rbstab.analysis.proof.index import proved_index
from rbstab.analysis.proof.lines.intervals import Intervals, exact
from rbstab.analysis.proof.outcome import SearchOutcome
from rbstab.analysis.proof.tied.bounds import ANGLES, SHIFT, Pose
from rbstab.analysis.proof.tied.energy import TiedEnergy
from rbstab.analysis.proof.tied.extent import scale_of
from rbstab.analysis.proof.tied.krawczyk import Image, image, inverses
from rbstab.mechanics.numbers import Array

BATCH = 512
"""Number of boxes examined at once."""

SHORT_NEWTON_STEPS = 12
"""Newton steps from a point that is near a zero, if there is one."""

BOX_LIMIT = 300_000
"""The number of boxes at which a search stops."""

BRIEF_BOX_LIMIT = 40_000
"""The number of boxes at which all searches of a brief proof stop together, those for regions among
them, with one spring or two: some five seconds. With more springs, each box takes longer."""

FORMULA_BOX_LIMIT, BRIEF_FORMULA_BOX_LIMIT = 100_000, 20_000
"""The same two limits for one formula of a user: some 4,000 boxes a second."""

MIN_RADIUS = 1e-7
"""rad, and the same part of the box of z: narrower boxes are not halved again."""

NARROWINGS = 3
"""The number of times that z is narrowed before a box is tested; energies of elements of users take
longer, and once is enough for them."""

MAX_STARTS = 32
"""The maximum number of boxes of a batch from which Newton's method is started."""

NEWTON_STEPS = 40
CONVERGED_STEP = 1e-9
RADII = np.geomspace(1e-14, 2.0, 120)
"""The radii of the boxes that are tried about a zero, relative to the scale of each variable."""


@dataclass(frozen=True, eq=False)
class TiedZero:
    """A zero of ∇W, at y = [Θ, z]: exactly one is in `enclosure`, and no other one is in `domain`.

    Both boxes have six variables and contain y, the zero to round-off. index is the number of
    negative eigenvalues of the Hessian in all of the enclosure; None if that is not proved.
    """

    y: Array
    enclosure: Boxes
    domain: Boxes
    index: int | None


@dataclass(frozen=True, eq=False)
class TiedZeros:
    """The zeros of ∇W with Θ in a box at which each line has a length.

    undecided are boxes of six variables that may contain further zeros.
    """

    zeros: tuple[TiedZero, ...]
    undecided: Boxes
    examined: int
    outcome: SearchOutcome


@dataclass
class _Search:
    energy: TiedEnergy
    scale: Array
    zeros: list[TiedZero] = field(default_factory=list)
    ambiguous: list[Boxes] = field(default_factory=list)
    failed: list[Array] = field(default_factory=list)

    def add_zeros_near(self, starts: Array, steps: int = NEWTON_STEPS) -> None:
        """Add the zeros to which Newton's method leads, if they are not known yet."""
        for y in newton(self.energy, starts, steps):
            if y is None or self._is_known(y):
                continue
            zero = isolated_zero(self.energy, y, self.scale)
            if zero is None:
                self.failed.append(y)
            elif any(zero.enclosure.within(other.domain)[0] for other in self.zeros):
                continue  # the same zero
            elif any(zero.enclosure.intersects(other.enclosure)[0] for other in self.zeros):
                self.ambiguous.append(zero.enclosure)
            else:
                self.zeros.append(zero)

    def _is_known(self, y: Array) -> bool:
        point = Boxes(y[np.newaxis], y[np.newaxis])
        known = any(point.within(zero.domain)[0] for zero in self.zeros)
        return known or any(
            np.abs((y - other) / self.scale).max() < 10 * CONVERGED_STEP for other in self.failed
        )

    def outside_domains(self, boxes: Boxes) -> Array:
        """Return whether each box is not part of the domain of a known zero."""
        left = np.ones(len(boxes), dtype=bool)
        for zero in self.zeros:
            left &= ~boxes.within(zero.domain)
        return left

    def examine(self, boxes: Boxes) -> tuple[Boxes, Array]:
        """Return what may contain an unknown zero, and the axis along which to cut each box."""
        boxes = boxes[self.outside_domains(boxes)]
        pose = Pose(self.energy, part(boxes, ANGLES))
        boxes, left = narrowed(pose, boxes)
        boxes, pose = boxes[left], pose[left]
        if not len(boxes):
            return boxes, np.zeros(0, dtype=int)
        found = image_of(pose, boxes)
        small = found.box
        left = ~np.any(small.low > small.high, axis=1)
        near = left & np.all(np.abs(found.step.middle) <= 2 * boxes.radius, axis=1)
        self.add_zeros_near(boxes.centre[near][:MAX_STARTS], SHORT_NEWTON_STEPS)
        left &= self.outside_domains(small)
        small, residual = small[left], found.residual[left]
        return small, self._axes(small, residual)

    def _axes(self, boxes: Boxes, residual: Array) -> Array:
        """Return the axis that adds most to |I - YH|δ, if this is known; else the widest."""
        relative = boxes.radius / self.scale
        smear = np.einsum("mij,i->mj", residual, 1 / self.scale) * boxes.radius
        usable = np.all(np.isfinite(smear), axis=1)
        return np.where(usable, smear.argmax(axis=1), relative.argmax(axis=1))


def box_limit(energy: TiedEnergy, most: int = BOX_LIMIT) -> int:
    """Return the number of boxes at which a search stops, at most a number."""
    count = len(energy.formulas)
    return min(most, FORMULA_BOX_LIMIT // count) if count else most


def brief_box_limit(energy: TiedEnergy) -> int:
    """Return the number of boxes at which all searches of a brief proof stop together."""
    formulas, lines = len(energy.formulas), len(energy.lines) + len(energy.ligaments)
    of_lines = 2 * BRIEF_BOX_LIMIT // max(2, lines)
    return min(of_lines, BRIEF_FORMULA_BOX_LIMIT // formulas) if formulas else of_lines


def part(boxes: Boxes, entries: slice) -> Boxes:
    """Return some axes of boxes."""
    return Boxes(boxes.low[:, entries], boxes.high[:, entries])


def narrowed(pose: Pose, boxes: Boxes, *, angles: bool = True) -> tuple[Boxes, Array]:
    """Narrow z in boxes; return them, and whether each may have a rest state.

    Args:
        pose: That of the boxes.
        boxes: The boxes of six variables.
        angles: Whether ∂W/∂Θ must be zero too, or ∂W/∂z alone.
    """
    entries = slice(0 if angles else SHIFT.start, None)
    low, high = boxes.low.copy(), boxes.high.copy()
    left = np.ones(len(boxes), dtype=bool)
    for _ in range(1 if pose.energy.formulas else NARROWINGS):
        bounds = pose.within(Boxes(low[:, SHIFT], high[:, SHIFT]))
        shift, gradient = bounds.shift, bounds.gradient[:, entries]
        low[:, SHIFT] = np.fmax(low[:, SHIFT], shift.low)
        high[:, SHIFT] = np.fmin(high[:, SHIFT], shift.high)
        # A bound that is no number says nothing.
        left &= ~np.any(low > high, axis=1) & ~bounds.unbalanced
        left &= ~np.any((gradient.low > 0) | (gradient.high < 0), axis=1)
        if pose.energy.ligaments or pose.energy.formulas:
            near = _by_newton(pose, Boxes(low[:, SHIFT], high[:, SHIFT]), bounds.hessian)
            low[:, SHIFT] = np.fmax(low[:, SHIFT], near.low)
            high[:, SHIFT] = np.fmin(high[:, SHIFT], near.high)
            left &= ~np.any(low > high, axis=1)
        # An empty box stays as it was: it is left out.
        empty = ~np.all(low <= high, axis=1)
        low[empty], high[empty] = boxes.low[empty], boxes.high[empty]
    return Boxes(low, high), left


def _by_newton(pose: Pose, z: Boxes, hessian: Intervals) -> Boxes:
    """Return boxes with all z at which ∂W/∂z = 0: z = m - Y∂W/∂z(Θ, m) + (I - YH)(z - m).

    Args:
        pose: That of the boxes.
        z: The boxes of z, with the centres m.
        hessian: The Hessian of W over the boxes; H is its part for z.
    """
    slope = pose.of(pose.over, exact(z.centre)).gradient[:, SHIFT]
    curved = hessian[:, SHIFT, SHIFT]
    return image(z, slope, curved.middle, curved).box


def image_of(pose: Pose, boxes: Boxes) -> Image:
    """Return the image of boxes in six variables; the pose belongs to the same boxes of Θ."""
    z = part(boxes, SHIFT)
    at_centre, over = pose.at(z.centre), pose.within(z)
    return image(boxes, at_centre.gradient, at_centre.hessian.middle, over.hessian)


def newton(energy: TiedEnergy, starts: Array, steps: int = NEWTON_STEPS) -> list[Array | None]:
    """Return the zeros of ∇W to which Newton's method leads from points, each from its own.

    All starts are followed at once, which takes little longer than one of them.

    Args:
        energy: W.
        starts: The points [Θ, z], shape (m, 6).
        steps: The largest number of steps.

    Returns:
        For each start the zero, or None.
    """
    y = starts.copy()
    last = np.full(len(y), np.inf)
    left = np.arange(len(y))
    for _ in range(steps):
        if not len(left):
            break
        Theta = Boxes(y[left, ANGLES], y[left, ANGLES])
        bounds = Pose(energy, Theta).at(y[left, SHIFT])
        gradient, hessian = bounds.gradient.middle, bounds.hessian.middle
        step = np.einsum("mij,mj->mi", inverses(hessian), gradient)
        size = np.abs(step).max(axis=1)
        shorter = np.minimum(1.0, 0.5 / np.maximum(size, 1e-300))
        y[left] -= step * shorter[:, np.newaxis]
        far = np.abs(y[left, ANGLES]).max(axis=1) > energy.form.reach
        failed = far | ~np.isfinite(size)
        last[left] = np.where(failed, np.inf, size)
        left = left[~failed & ~(size < 1e-14)]
    pairs = zip(y, last.tolist(), strict=True)
    return [point if size < CONVERGED_STEP else None for point, size in pairs]


def isolated_zero(energy: TiedEnergy, y: Array, scale: Array) -> TiedZero | None:
    """Prove that a zero near a point exists, and that it is the only one in a box about it."""
    boxes = joined([box_around(y, radius * scale) for radius in RADII])
    pose = Pose(energy, part(boxes, ANGLES))
    found = image_of(pose, boxes)
    unique = found.at_most_one_zero
    exactly_one = np.flatnonzero(unique & found.at_least_one_zero)
    if not len(exactly_one):
        return None
    first, widest = exactly_one[0], np.flatnonzero(unique)[-1]
    hessian = pose.within(part(boxes, SHIFT)).hessian[first]
    return TiedZero(
        y,
        boxes[first : first + 1],
        boxes[widest : widest + 1],
        proved_index(hessian.middle, hessian.radius),
    )


def prove(
    energy: TiedEnergy,
    starts: Sequence[Array] = (),
    end: Array = RANGE_END,
    box_limit: int = BOX_LIMIT,
) -> TiedZeros:
    """Enclose every zero of ∇W with -end <= Θ <= end at which each line has a length.

    Args:
        energy: W.
        starts: Points [Θ, z] from which Newton's method is started; they only save time.
        end: The largest |Θ|, shape (3,), rad.
        box_limit: The number of boxes at which the search stops.

    Raises:
        ValueError: z has no bounds: then no box covers all rest states.
    """
    scale = scale_of(energy)
    if not np.all(np.isfinite(scale)):
        raise ValueError("no bound on z")
    search = _Search(energy, scale)
    with np.errstate(all="ignore"):
        search.add_zeros_near(np.array(starts).reshape(-1, 6))
        whole = np.concatenate([end, scale[SHIFT]])
        pending, undecided, examined = Boxes(-whole[np.newaxis], whole[np.newaxis]), [], 0
        while len(pending) and examined < box_limit:
            batch, pending = pending[:BATCH], pending[BATCH:]
            examined += len(batch)
            left, axis = search.examine(batch)
            small = (left.radius / scale).max(axis=1, initial=0.0) < MIN_RADIUS
            undecided.append(left[small])
            pending = joined([pending, left[~small].halves(axis[~small])])
    remaining = joined([_nothing(), pending, *undecided])
    remaining = remaining[search.outside_domains(remaining)]
    return _classified(search, remaining, examined, end, stopped=bool(len(pending)))


def _classified(
    search: _Search, undecided: Boxes, examined: int, end: Array, *, stopped: bool
) -> TiedZeros:
    whole = Boxes(-end[np.newaxis], end[np.newaxis])
    inside, unclear = [], [undecided, *search.ambiguous]
    for zero in search.zeros:
        Theta = part(zero.enclosure, ANGLES)
        if Theta.within(whole)[0]:
            inside.append(zero)
        elif Theta.intersects(whole)[0]:
            unclear.append(zero.enclosure)
    left = joined(unclear)
    outcome = SearchOutcome.UNDECIDED if len(left) else SearchOutcome.PROVED
    if stopped:
        outcome = SearchOutcome.BOX_LIMIT
    return TiedZeros(tuple(inside), left, examined, outcome)


def _nothing() -> Boxes:
    return Boxes(np.zeros((0, 6)), np.zeros((0, 6)))
