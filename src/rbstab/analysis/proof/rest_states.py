"""All rest states of a system in the range of eq. 5, and whether there is exactly one."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from rbstab.analysis.proof.boxes import RANGE_END, ROUNDING_FACTOR, Boxes, box_around, no_boxes
from rbstab.analysis.proof.branch_and_bound import BOX_LIMIT, SearchOutcome, prove
from rbstab.analysis.proof.enclosure import enclosure
from rbstab.analysis.proof.guards.kinks import FREE, kink_at, kink_index
from rbstab.analysis.proof.index import proved_index
from rbstab.analysis.proof.reduced_energy import (
    ExactSystem,
    NoEnergyReason,
    NoReducedEnergy,
    ReducedEnergy,
    reduced_energy,
)
from rbstab.analysis.proof.searches.families import is_family, singular, without_family
from rbstab.analysis.proof.searches.zeros import search
from rbstab.analysis.proof.traced.held import surface_at
from rbstab.analysis.proof.trigonometric import TrigonometricForm
from rbstab.analysis.proof.zero import Zero
from rbstab.analysis.rest_state import RestState, held_at_kink, rest_state_at
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import PITCH
from rbstab.systems.system import System

UPWARDS = np.array([0.0, 1.0, 0.0])
"""Across an angle of θ2 at which a guard jumps."""

NO_SLOPES = np.zeros(3)
"""J/rad: what is added to U has no slope."""


@dataclass(frozen=True, eq=False)
class RestPoint:
    """One of the rest states of a system.

    state has its Θ, X, own states, energy and remaining gradient. index is the number of negative
    eigenvalues of the Hessian of the reduced energy: 0 at a minimum. Where a guard holds θ2
    (`state.on_kink`), it is that of the Hessian by θ1 and θ3. Where an element of a user holds the
    body on a surface, it is that along the surface; and one more if the force pushes away from this
    surface (`on_ridge`). If `proved`, enclosure is one box of Θ that contains exactly one rest
    state; else it contains only the point. index_proved is whether the index is proved for the
    exact rest state; degenerate is whether it is not, and the Hessian is singular to round-off.
    """

    state: RestState
    index: int
    enclosure: Boxes
    proved: bool
    index_proved: bool
    on_ridge: bool = False
    degenerate: bool = False

    @property
    def Theta(self) -> Array:
        """Θ, shape (3,), rad."""
        return self.state.motion.Theta

    @property
    def stable(self) -> bool:
        """Whether this is a minimum of the stored energy; otherwise it is a saddle or a maximum."""
        return self.index == 0


@dataclass(frozen=True, eq=False)
class RestStates:
    """The rest states of a system in the range of eq. 5, from the lowest energy to the highest.

    energy is the reduced energy. undecided are boxes of Θ that may contain further rest states.
    examined is the number of boxes that the proof examined. outcome is how the proof ended. end is
    the largest |Θ| in the range, shape (3,), rad; by default that of eq. 5. With a barrier, the
    range goes on to θ2 = ±π/2, but beyond `end` the energy only rises, and nothing is at rest. With
    a stop, the range ends there. covered is the share of the range that the proof has finished.
    """

    energy: ReducedEnergy
    states: tuple[RestPoint, ...]
    undecided: Boxes
    examined: int
    outcome: SearchOutcome
    end: Array = field(default_factory=RANGE_END.copy)
    covered: float = 1.0

    @property
    def proved(self) -> bool:
        """Whether these are proved to be all rest states in the range."""
        return self.outcome is SearchOutcome.PROVED

    @property
    def counterexample(self) -> RestPoint | None:
        """A rest state other than the lowest: a body at rest there does not converge to the lowest.

        If there is one, no Lyapunov function can prove global stability in the range.
        """
        return self.states[1] if len(self.states) > 1 else None

    @property
    def unique(self) -> bool | None:
        """Whether the range has exactly one rest state; None if neither answer is proved.

        If True and the rest state is stable, every motion that stays in the range, and keeps a
        distance from θ2 = ±π/2, converges to it (La Salle's theorem).
        """
        if sum(point.proved for point in self.states) > 1:
            return False
        if not self.proved:
            return None
        return len(self.states) == 1

    @property
    def closed(self) -> bool:
        """Whether all motions from the range of eq. 5 converge to the one rest state (theorem 10).

        It needs barriers on θ1 and θ3 too, which keep these motions in the range.
        """
        guard = self.energy.form.guard
        return guard is not None and guard.outer is not None and self.every_start

    @property
    def every_start(self) -> bool:
        """Whether all motions from |θ2| < π/2 converge to the only rest state (theorem 10).

        To be asked of the rest states for all real θ1 and θ3: a barrier or a stop keeps all motions
        away from θ2 = ±π/2, and the energy grows with |θ1| and |θ3| (`unwrapped_rest_states`). With
        barriers on θ1 and θ3, of those in the range of eq. 5: then it is of motions that start
        there.
        """
        point = self.states[0] if self.proved and self.unique else None
        is_minimum = point is not None and point.index_proved and point.index == 0
        guard = self.energy.form.guard
        return guard is not None and guard.closed and is_minimum


def rest_states(
    system: System,
    exact_system: ExactSystem | None = None,
    *,
    proof: bool = True,
    seed: int = 0,
    box_limit: int = BOX_LIMIT,
) -> RestStates:
    """Find the rest states of a system, and prove that there are no others.

    Args:
        system: The system.
        exact_system: As for `reduced_energy`.
        proof: Whether to prove it; without a proof the outcome is `SearchOutcome.SEARCHED`.
        seed: Seed of the search.
        box_limit: The number of boxes at which the proof stops.

    Raises:
        NoReducedEnergy: The system has no reduced potential energy; the error gives the reason.
    """
    energy = reduced_energy(system, exact_system)
    found = search(energy.form, seed, end=within_stops(energy.form, RANGE_END))
    if proof:
        end = end_of_rest_states(energy.form, RANGE_END)
        return proved_rest_states(energy, end, list(found), box_limit)
    zeros, outcome = list(found), SearchOutcome.SEARCHED
    if is_family(energy.form, zeros):
        zeros, outcome = without_family(energy.form, zeros), SearchOutcome.FAMILY
    points = [_point(energy, Theta) for Theta in zeros]
    return RestStates(energy, _in_order(points), no_boxes(), 0, outcome)


def within_stops(form: TrigonometricForm, end: Array) -> Array:
    """Return the largest |Θ| in a range that a motion can reach with stops, shape (3,), rad."""
    if form.guard is None:
        return end
    return np.array([end[0], min(end[1], form.guard.end), end[2]])


def end_of_rest_states(
    form: TrigonometricForm, end: Array, slopes: Array = NO_SLOPES, times: float = 1.0
) -> Array:
    """Return the largest |Θ| in a range at which a rest state is possible, shape (3,), rad.

    It is that of a stop. And from some angle on, the slope of a barrier is larger than any slope of
    the rest of U, so that U rises with this angle up to the end: soft guards rise too.

    Args:
        form: U.
        end: The largest |Θ| in the range, shape (3,), rad.
        slopes: Bounds on the slopes of what is added to U, shape (3,), J/rad.
        times: The slope of the barrier is so many times that of the rest: a farther end.

    Raises:
        NoReducedEnergy: The barrier is too weak for double precision, or no bound is found on the
            slopes of the rest.
    """
    wide, end = end, within_stops(form, end).copy()
    guard = form.guard
    if guard is None:
        return end
    for axis, barrier in ((PITCH, guard.barrier), (0, guard.outer), (2, guard.outer)):
        if barrier is not None:
            steepest = np.abs(form.quadratic[axis]) @ wide + abs(form.linear[axis])
            steepest += form.steepest[axis] + slopes[axis]
            if not np.isfinite(steepest):
                raise NoReducedEnergy(NoEnergyReason.NO_SLOPES)
            angle = barrier.end_beyond(times * float(steepest) * ROUNDING_FACTOR)
            if angle is None:
                raise NoReducedEnergy(NoEnergyReason.WEAK_BARRIER)
            end[axis] = min(end[axis], angle)
    return end


def proved_rest_states(
    energy: ReducedEnergy, end: Array, found: Sequence[Array], box_limit: int
) -> RestStates:
    """Prove the rest states with -end <= Θ <= end.

    Args:
        energy: The reduced energy.
        end: The largest |Θ|, shape (3,), rad.
        found: Points that a search found, each of shape (3,), rad.
        box_limit: The number of boxes at which the proof stops.
    """
    zeros = prove(energy.form, found, box_limit, end)
    points = [_point(energy, zero.Theta, zero) for zero in zeros.inside]
    if zeros.outcome is not SearchOutcome.PROVED:
        # Points that could not be isolated, such as a nearly double zero, stay in the list. If all
        # zeros are known, such a point is none. Those of a family are not counted.
        if zeros.outcome is SearchOutcome.FAMILY:
            found = without_family(energy.form, found)
        points += [
            _point(energy, Theta)
            for Theta in found
            if not any(zero.domain_contains(Theta) for zero in zeros.inside)
        ]
    states, left = _in_order(points), zeros.undecided
    return RestStates(energy, states, left, zeros.examined, zeros.outcome, end, zeros.covered)


def _in_order(points: list[RestPoint]) -> tuple[RestPoint, ...]:
    return tuple(sorted(points, key=lambda point: point.state.energy))


def _point(energy: ReducedEnergy, Theta: Array, zero: Zero | None = None) -> RestPoint:
    state = rest_state_at(energy.configurations, energy.configuration(Theta))
    kink = kink_at(energy.form.guard, float(Theta[1]))
    may_be_held = kink is None and (zero is None or zero.at_kink)
    surface = surface_at(energy.form, Theta) if may_be_held else None
    if kink is not None:
        state = held_at_kink(energy.configurations, state, UPWARDS)
    elif surface is not None:
        state = held_at_kink(energy.configurations, state, surface.normal(Theta))
    proved, index = zero is not None, None
    box = box_around(Theta, 0.0) if zero is None else zero.enclosure
    if proved and kink is not None:
        index = kink_index(energy.form, kink, box)
    elif proved and surface is not None:
        index = surface.index(box)
    elif proved:
        bounds = enclosure(energy.form, box)
        index = proved_index(bounds.hessian[0], bounds.hessian_radius[0])
    index_proved, degenerate = index is not None, False
    if index is None and surface is not None:
        index = surface.approximate_index(Theta)
    elif index is None:
        hessian = energy.form.approximate(Theta[np.newaxis], 2)[2][0]
        if kink is not None:
            hessian = hessian[np.ix_(FREE, FREE)]
        index = int(np.sum(np.linalg.eigvalsh(hessian) < 0))
        degenerate = bool(singular(hessian[np.newaxis])[0])
    on_ridge = surface is not None and surface.kink.ridge
    return RestPoint(state, index, box, proved, index_proved, on_ridge, degenerate)
