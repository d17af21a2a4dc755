"""All rest states of a system in the range of eq. 5, and what follows from their number."""

from dataclasses import dataclass

import numpy as np

from rbstab.analysis.proof.boxes import Boxes, box_around, no_boxes
from rbstab.analysis.proof.branch_and_bound import BOX_LIMIT, Outcome, prove
from rbstab.analysis.proof.reduced_energy import ReducedEnergy, reduced_energy
from rbstab.analysis.proof.search import search
from rbstab.analysis.rest_state import RestState, rest_state_at
from rbstab.mechanics.numbers import Array
from rbstab.systems.system import System


@dataclass(frozen=True, eq=False)
class RestPoint:
    """One rest state among all of a system.

    state has its Θ, X, own states, energy and the gradient that is left; index is the number of
    directions in which the reduced energy falls: 0 at a minimum. enclosure is one box of Θ in which
    exactly one rest state is, where `proved`; else the point alone.
    """

    state: RestState
    index: int
    enclosure: Boxes
    proved: bool

    @property
    def Theta(self) -> Array:
        """Θ, shape (3,), rad."""
        return self.state.motion.Theta

    @property
    def stable(self) -> bool:
        """Whether it is a minimum of the stored energy; a saddle otherwise (or a maximum)."""
        return self.index == 0


@dataclass(frozen=True, eq=False)
class RestStates:
    """The rest states of a system in the range of eq. 5, from the lowest energy to the highest.

    energy is the reduced energy. undecided are boxes of Θ that may hold further ones; examined is
    the number of boxes of the proof; outcome says how it ended.
    """

    energy: ReducedEnergy
    states: tuple[RestPoint, ...]
    undecided: Boxes
    examined: int
    outcome: Outcome

    @property
    def proved(self) -> bool:
        """Whether these are all the rest states of the range."""
        return self.outcome is Outcome.PROVED

    @property
    def counterexample(self) -> RestPoint | None:
        """A state other than the lowest at which the body rests: it does not converge from there.

        Where there is one, no Lyapunov function can show global stability in the range.
        """
        return self.states[1] if len(self.states) > 1 else None

    @property
    def unique(self) -> bool | None:
        """Whether the range has one rest state and no more.

        By La Salle's theorem all that stays in the range then comes to it, if it is stable. None
        where neither that nor a counterexample is proved.
        """
        if sum(point.proved for point in self.states) > 1:
            return False
        if not self.proved:
            return None
        return len(self.states) == 1


def rest_states(
    system: System, *, proof: bool = True, seed: int = 0, box_limit: int = BOX_LIMIT
) -> RestStates:
    """All rest states of a system: looked for, then proved to be all.

    Args:
        system: The system.
        proof: Whether to prove it; a search alone leaves `Outcome.SEARCHED`.
        seed: Of the search.
        box_limit: The number of boxes at which the proof gives up.

    Raises:
        NoReducedEnergy: The system has no reduced potential energy; the error says why.
    """
    energy = reduced_energy(system)
    found = search(energy.form, seed)
    if not proof:
        points = [_point(energy, Theta) for Theta in found]
        return RestStates(energy, _in_order(points), no_boxes(), 0, Outcome.SEARCHED)
    zeros = prove(energy.form, found, box_limit)
    points = [_point(energy, zero.Theta, zero.enclosure) for zero in zeros.inside]
    # What was found and is no isolated zero, such as one where two are about to part, stays listed.
    points += [
        _point(energy, Theta)
        for Theta in found
        if not any(zero.owns(Theta) for zero in zeros.inside)
    ]
    return RestStates(energy, _in_order(points), zeros.undecided, zeros.examined, zeros.outcome)


def _in_order(points: list[RestPoint]) -> tuple[RestPoint, ...]:
    return tuple(sorted(points, key=lambda point: point.state.energy))


def _point(energy: ReducedEnergy, Theta: Array, enclosure: Boxes | None = None) -> RestPoint:
    state = rest_state_at(energy.configurations, energy.configuration(Theta))
    hessian = energy.form.to_round_off(Theta[np.newaxis], 2)[2][0]
    index = int(np.sum(np.linalg.eigvalsh(hessian) < 0))
    proved = enclosure is not None
    return RestPoint(state, index, enclosure or box_around(Theta, 0.0), proved)
