"""The rest states of a tied body with springs, in one range of Θ, with the region of the lowest."""

from dataclasses import dataclass, replace

import numpy as np

from rbstab.analysis.proof.boxes import RANGE_END, Boxes, box_around
from rbstab.analysis.proof.outcome import SearchOutcome
from rbstab.analysis.proof.reduced_energy import NoEnergyReason, NoReducedEnergy
from rbstab.analysis.proof.range_end import end_of_rest_states
from rbstab.analysis.proof.rest_point import RestPoint
from rbstab.analysis.proof.tied.bounds import ANGLES, SHIFT, Pose
from rbstab.analysis.proof.tied.energy import TiedEnergy
from rbstab.analysis.proof.tied.extent import (
    is_periodic,
    largest_with_shift,
    scale_of,
    slopes_with_shift,
)
from rbstab.analysis.proof.tied.region import TiedRegion, tied_region
from rbstab.analysis.proof.tied.search import (
    BOX_LIMIT,
    TiedZero,
    part,
    prove,
)
from rbstab.analysis.proof.tied.search import (
    box_limit as limit_of,
)
from rbstab.analysis.proof.unwrapped import BOX_LIMIT_WITH_LINES, MAX_END, confined_end
from rbstab.analysis.rest_state import rest_state_at
from rbstab.mechanics.numbers import Array

BORDER_SLOPE = 8.0
"""With a barrier, the range ends where its slope is so many times that of all else. The energy on
this border limits the region, so it is farther than rest states need."""

SHARE_OF_SEARCH = 0.75
"""The share of the boxes of a brief proof after which the search for rest states ends, so that
there may be a region where a continuum of rest states is far above the lowest one."""

STARTS = 60
"""The number of points from which Newton's method looks for rest states first."""


@dataclass(frozen=True, eq=False)
class TiedPoint:
    """A rest state, and the box of z that belongs to its enclosure."""

    point: RestPoint
    shift: Boxes


@dataclass(frozen=True, eq=False)
class TiedRestStates:
    """The rest states of a tied body with springs, from the lowest energy to the highest.

    undecided are the boxes of Θ, over any z, that may have further rest states. end is the largest
    |Θ|, shape (3,), rad. examined counts the boxes of the search alone.
    """

    energy: TiedEnergy
    states: tuple[TiedPoint, ...]
    undecided: Boxes
    examined: int
    outcome: SearchOutcome
    region: TiedRegion | None
    end: Array

    @property
    def proved(self) -> bool:
        """Whether these are proved to be all rest states at which each spring has a length."""
        return self.outcome is SearchOutcome.PROVED

    @property
    def stopped(self) -> bool:
        """Whether more boxes may prove more: of the rest states, or of the region."""
        no_bound = self.region is not None and self.region.energy_bound is None
        return self.outcome is SearchOutcome.BOX_LIMIT or no_bound

    @property
    def boxes(self) -> int:
        """The number of boxes of the search and of the region."""
        return self.examined + (0 if self.region is None else self.region.examined)

    @property
    def unique(self) -> bool | None:
        """Whether there is exactly one; None if neither answer is proved."""
        if len(self.states) > 1:
            return False
        return len(self.states) == 1 if self.proved else None

    @property
    def every_start(self) -> bool:
        """Whether all motions from |θ2| < π/2 converge to the only rest state.

        To be asked of the rest states for all real θ1 and θ3, or with barriers on them. A barrier
        keeps all motions away from θ2 = ±π/2; and there must be no spring, which may lose its
        length on the way.
        """
        only = self.states[0].point if self.unique else None
        is_minimum = only is not None and only.index_proved and only.index == 0
        guard = self.energy.form.guard
        return guard is not None and guard.closed and is_minimum and not self.energy.lines


def tied_rest_states(
    energy: TiedEnergy,
    end: Array = RANGE_END,
    box_limit: int = BOX_LIMIT,
    total: int | None = None,
) -> TiedRestStates:
    """Prove the rest states with -end <= Θ <= end, and the region of the lowest.

    Args:
        energy: W.
        end: The largest |Θ|, shape (3,), rad.
        box_limit: The number of boxes at which each search stops.
        total: The number of boxes at which both searches stop together; None: no such limit.

    With a barrier the range of θ2 ends where W rises with |θ2| up to ±π/2, for all z. Beyond it
    there is no rest state, and W is above the border of this range.

    Raises:
        NoReducedEnergy: No bound on z is found, or a barrier is too weak for double precision.
    """
    if not np.all(np.isfinite(scale_of(energy))):
        raise NoReducedEnergy(NoEnergyReason.NO_EXTENT)
    end = end_of_rest_states(energy.form, end, slopes_with_shift(energy), BORDER_SLOPE)
    reach = max(energy.form.reach, *end)
    if reach > energy.form.reach:  # else its bounds are known
        energy = replace(energy, form=replace(energy.form, reach=reach))
    box_limit = limit_of(energy, box_limit)
    of_search = None if total is None else int(SHARE_OF_SEARCH * total)
    found = prove(energy, _starts(end), end, _limit(box_limit, of_search, 0))
    region = tied_region(energy, found, end, _limit(box_limit, total, found.examined))
    points = sorted(
        (_point(energy, zero) for zero in found.zeros), key=lambda one: one.point.state.energy
    )
    return TiedRestStates(
        energy,
        tuple(points),
        part(found.undecided, ANGLES),
        found.examined,
        found.outcome,
        region,
        end,
    )


def _limit(box_limit: int, total: int | None, examined: int) -> int:
    return box_limit if total is None else min(box_limit, total - examined)


def unwrapped_tied_states(
    energy: TiedEnergy,
    rest: TiedRestStates,
    box_limit: int = BOX_LIMIT_WITH_LINES,
    total: int | None = None,
) -> TiedRestStates | None:
    """Prove the rest states with |θ2| < π/2 and any θ1 and θ3; None without bounds for them.

    Args:
        energy: W.
        rest: Those in the range of eq. 5. They are returned if there are none beyond it.
        box_limit: The number of boxes at which each search stops.
        total: As in `tied_rest_states`.
    """
    end = tied_end(energy)
    if end is None or not np.all(end < MAX_END):
        return None
    if np.array_equal(end, RANGE_END):
        return rest
    return tied_rest_states(energy, end, box_limit, total)


def tied_end(energy: TiedEnergy) -> Array | None:
    """Return the largest |Θ| of a box that contains all rest states, as `unwrapped_end` does.

    A barrier on θ2 is not in the equations by θ1 and θ3.
    """
    guard = energy.form.guard
    if not is_periodic(energy) or (guard is not None and guard.outer is not None):
        return None
    form = replace(energy.form, guard=None)
    steepest = (form.steepest + slopes_with_shift(energy))[[0, 2]] * (1 + 1e-12)
    return confined_end(form, steepest, form.largest + largest_with_shift(energy))


def _starts(end: Array) -> list[Array]:
    rng = np.random.default_rng(0)
    angles = [np.zeros(3), *rng.uniform(-end, end, size=(STARTS, 3))]
    return [np.concatenate([Theta, np.zeros(3)]) for Theta in angles]


def _point(energy: TiedEnergy, zero: TiedZero) -> TiedPoint:
    q = energy.configuration(zero.y[ANGLES], zero.y[SHIFT])
    state = rest_state_at(energy.configurations, q)
    index = zero.index
    if index is None:
        index = _computed_index(energy, zero.y)
    box, proved = part(zero.enclosure, ANGLES), zero.index is not None
    point = RestPoint(state, index, box, proved=True, index_proved=proved)
    return TiedPoint(point, part(zero.enclosure, SHIFT))


def _computed_index(energy: TiedEnergy, y: Array) -> int:

    Theta = box_around(y[ANGLES], 0.0)
    hessian = Pose(energy, Theta).at(y[np.newaxis, SHIFT]).hessian.middle[0]
    return int(np.sum(np.linalg.eigvalsh(hessian) < 0))
