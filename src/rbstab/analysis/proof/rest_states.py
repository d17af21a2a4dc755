"""All rest states of a system in the range of eq. 5, and whether there is exactly one."""

from dataclasses import dataclass, field

import numpy as np

from rbstab.analysis.proof.boxes import RANGE_END, ROUNDING_FACTOR, Boxes
from rbstab.analysis.proof.outcome import SearchOutcome
from rbstab.analysis.proof.reduced_energy import NoEnergyReason, NoReducedEnergy, ReducedEnergy
from rbstab.analysis.proof.trigonometric import TrigonometricForm
from rbstab.analysis.rest_state import RestState
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import PITCH

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
        away from θ2 = ±π/2, and the energy grows with |θ1| and |θ3| (`unwrapped_end`). With
        barriers on θ1 and θ3, of those in the range of eq. 5: then it is of motions that start
        there.
        """
        point = self.states[0] if self.proved and self.unique else None
        is_minimum = point is not None and point.index_proved and point.index == 0
        guard = self.energy.form.guard
        return guard is not None and guard.closed and is_minimum


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
