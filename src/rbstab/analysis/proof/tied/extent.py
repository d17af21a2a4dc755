"""Bounds that hold for all Θ: on z at rest states, and on the slopes of what depends on z.

Let ∂W/∂z = 0. With springs alone z = -S⁻¹Σ w_j u_j, so |z_i| is at most the norm of a row of S⁻¹
times Σ |w_j|. Else let C be all of W but the lines of springs. It is convex in z, and z is the only
minimum of C - q'z for a q with |q| <= Σ |w_j|. It lies in a box, if ∂C/∂z_i is above Σ |w_j| on the
upper face along z_i, and below -Σ |w_j| on the lower one, for each i: by Miranda's theorem there is
a zero of the derivative in the box.
"""

from dataclasses import replace
from functools import lru_cache

import numpy as np

from rbstab.analysis.proof.boxes import RANGE_END, Boxes, grid
from rbstab.analysis.proof.formulas.jets import Jet
from rbstab.analysis.proof.ligaments.free import FreeLigament
from rbstab.analysis.proof.lines.intervals import between, exact
from rbstab.analysis.proof.tied.bounds import SHIFT, Pose
from rbstab.analysis.proof.tied.energy import FreeLine, TiedEnergy
from rbstab.analysis.proof.tied.seen import shifts
from rbstab.mechanics.numbers import Array

CELLS = (16, 8, 16)
"""The boxes by axis over which the energies of elements of users are bounded."""

CELLS_OF_SHIFT = ((8, 4, 8), (16, 8, 16))
"""The same for the bounds on z; the second ones are tried if the first ones are too wide."""

SAMPLES = 200
"""The number of Θ at which z is computed first."""

FIRST_ROOM, WIDER, LEAST_SHARE = 1.2, 1.3, 0.05
"""The first bounds are so much larger than all z that were seen, and so are the next ones; each is
at least this share of the largest."""

TRIES = 40

FEW = 11
"""Each of so many cells is one of the few that are tried first."""

KEPT = 8
"""The number of energies whose bounds are kept."""

MARGIN = 1 + 1e-12
"""A factor that exceeds the rounding errors of a bound."""


@lru_cache(KEPT)
def scale_of(energy: TiedEnergy) -> Array:
    """Return 1 rad for each angle, and bounds on |z_i| where ∂W/∂z = 0, shape (6,), m.

    The bounds are infinite if none are found.
    """
    pull = sum(abs(line.weight) for line in energy.lines)
    if energy.ligaments or energy.formulas:
        found = _box_of_shift(energy, pull)
    else:
        found = np.sqrt((energy.compliance**2).sum(axis=1)) * pull * MARGIN
    return np.concatenate([np.ones(3), found])


def _box_of_shift(energy: TiedEnergy, pull: float) -> Array:
    """Return bounds on |z_i| by Miranda's theorem, shape (3,), m."""
    Theta = np.random.default_rng(0).uniform(-RANGE_END, RANGE_END, size=(SAMPLES, 3))
    seen = np.abs(shifts(energy, Theta)).max(axis=0)
    first = FIRST_ROOM * seen + LEAST_SHARE * seen.max() + 1e-9
    with np.errstate(all="ignore"):
        for counts in CELLS_OF_SHIFT:
            convex = Pose(replace(energy, lines=()), grid(RANGE_END, counts))
            found = _widened(convex, first, pull)
            if found is not None:
                return found
    return np.full(3, np.inf)


def _widened(convex: Pose, bound: Array, pull: float) -> Array | None:
    """Return a box of z, widened until ∂C/∂z points outwards on its faces; None: never."""
    # A few cells tell most boxes that are too small.
    few = convex[np.arange(0, len(convex.over.Theta.middle), FEW)]
    for _ in range(TRIES):
        inside = _axes_inside(few, bound, pull)
        if inside.all():
            inside = _axes_inside(convex, bound, pull)
        if inside.all():
            return bound
        bound = np.where(inside, bound, WIDER * bound)
    return None


def _axes_inside(convex: Pose, bound: Array, pull: float) -> Array:
    """Return for each axis whether ∂C/∂z_i points outwards on both faces of a box."""
    return np.array([_falls_inside(convex, bound, axis, pull) for axis in range(3)])


def _falls_inside(convex: Pose, bound: Array, axis: int, pull: float) -> bool:
    """Return whether ∂C/∂z_i points outwards on both faces of a box, by more than `pull`."""
    for side in (-1.0, 1.0):
        low, high = -bound, bound.copy()
        low[axis] = high[axis] = side * bound[axis]
        z = between(*(np.tile(end, (len(convex.over.Theta.middle), 1)) for end in (low, high)))
        bounds = convex.of(convex.over, z)
        slope = (bounds.pulled + bounds.force)[:, axis]
        outwards = slope.low if side > 0 else -slope.high
        if not np.all(outwards > pull * MARGIN):
            return False
    return True


@lru_cache(KEPT)
def slopes_with_shift(energy: TiedEnergy) -> Array:
    """Bound the slopes by Θ of all parts that depend on z, for these z, shape (3,), J/rad.

    Those of lines hold for all z: the energy of a line has the slope w u'∂r/∂θ_i.
    """
    total, z = np.zeros(3), scale_of(energy)[SHIFT]
    for line in energy.lines:
        total += abs(line.weight) * np.sqrt((_slopes_of(line) ** 2).sum(axis=0)) * MARGIN
    for ligament in energy.ligaments:
        total += _tension(ligament, _size(z)) * ligament.turned * MARGIN
    for formula in _formulas_over_cells(energy, z):
        total += np.array([_largest(row) for row in formula.rows.size[1:4]])
    return total * MARGIN


def largest_with_shift(energy: TiedEnergy) -> float:
    """Bound the magnitude of all parts that depend on z, for these z, J."""
    scale = scale_of(energy)[SHIFT]
    total, z = 0.0, float(np.linalg.norm(scale))
    for line in energy.lines:
        sizes = [float(form.trigonometric_bound(0)) for form in line.offset]
        total += abs(line.weight) * (z + float(np.linalg.norm(sizes)))
    for ligament in energy.ligaments:
        farthest = exact(np.array([(ligament.longest + _size(scale)) ** 2]))
        total += float(ligament.law.bounds(farthest, 0)[0].high[0])
    for formula in _formulas_over_cells(energy, scale):
        total += _largest(formula.rows.size[0])
    return total


def is_periodic(energy: TiedEnergy) -> bool:
    """Return whether the bounds on formulas hold for all θ1 and θ3."""
    return all(formula.program.periodic for formula in energy.formulas)


def _formulas_over_cells(energy: TiedEnergy, z: Array) -> list[Jet]:
    """Return the energies of elements of users for |θ_i| in the range of eq. 5, and |z_i| <= z."""
    if not energy.formulas:
        return []
    cells = grid(RANGE_END, CELLS)
    wide = np.broadcast_to(z, (len(cells), 3))
    with np.errstate(all="ignore"):
        return Pose(energy, cells).within(Boxes(-wide, wide)).formulas


def _largest(sizes: Array) -> float:
    """Return the largest of some bounds; one that is no number is infinite."""
    return float(np.where(np.isfinite(sizes), sizes, np.inf).max(initial=0.0))


def _slopes_of(line: FreeLine) -> Array:
    """Bound |∂r_k/∂θ_i| of a line, shape (3, 3)."""
    return np.array([form.trigonometric_bound(1) for form in line.offset])


def _tension(ligament: FreeLigament, shift: float) -> float:
    """Bound the tension of a ligament at all Θ, and |z| up to `shift`, N."""
    farthest = exact(np.array([(ligament.longest + shift) ** 2 * MARGIN]))
    return float(ligament.law.tension(farthest).high[0])


def _size(z: Array) -> float:
    return float(np.linalg.norm(z)) * MARGIN
