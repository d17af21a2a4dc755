"""The rest states of a system in a range of Θ, with what is proved of them."""

from dataclasses import dataclass
from enum import Enum
from typing import Any

from rbstab.analysis.rest_state import RestState
from rbstab.mechanics.numbers import Array
from rbstab.proof.entries import ProvedState
from rbstab.proof.search import Zeros


class SearchOutcome(Enum):
    """How a search for all rest states ended; the value is the text to show."""

    PROVED = "every zero in the range is known"
    UNDECIDED = (
        "in some small parts of the range it could not be decided whether there is a rest state"
    )
    BOX_LIMIT = "the limit on the number of boxes was reached"
    FAMILY = "a continuum (a family) of rest states is suspected, which is not counted"
    SEARCHED = "looked for, not proved"


def state_entry(rest: RestState, index: int, **more: Any) -> ProvedState:
    """Return a rest state as it is stored.

    Args:
        rest: Its Θ, X, own states and energy.
        index: The number of negative eigenvalues of the Hessian of U(Θ): 0 at a minimum. Where a
            stop or a force that jumps holds the body, that along the surface, and one more if the
            force pushes away from it.
        more: Other entries of `ProvedState`; by default nothing is proved.
    """
    Theta = rest.motion.Theta
    nothing = {"proved": False, "enclosure": (Theta, Theta)}
    return ProvedState(
        orientation=Theta,
        position=rest.motion.X,
        connector_state=rest.element_states,
        energy=rest.energy,
        index=index,
        held=rest.on_kink or None,
        **nothing | more,
    )


@dataclass(frozen=True, eq=False)
class RestStates:
    """The rest states of a system in a range of Θ, from the lowest energy to the highest.

    Args:
        states: The rest states. Those that are proved come first, in the order of `zeros`.
        zeros: The same as zeros of ∇U, and the boxes that may contain others.
        outcome: How the proof ended.
        end: The largest |Θ| in the range, shape (3,), rad; that of θ2 is the angle of a stop.
        closed: The angles of which no motion reaches the end of the range.
    """

    states: tuple[ProvedState, ...]
    zeros: Zeros
    outcome: SearchOutcome
    end: Array
    closed: frozenset[int]

    @property
    def examined(self) -> int:
        """The number of boxes that the proof examined."""
        return self.zeros.examined

    @property
    def covered(self) -> float:
        """The share of the range that the proof has finished."""
        return self.zeros.share

    @property
    def proved(self) -> bool:
        """Whether these are proved to be all rest states in the range."""
        return self.outcome is SearchOutcome.PROVED

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
    def every_start(self) -> bool:
        """Whether all motions from |θ2| < π/2 converge to the only rest state (theorem 10).

        To be asked of the rest states for all real θ1 and θ3: a barrier or a stop keeps all motions
        away from θ2 = ±π/2, and the energy grows with |θ1| and |θ3| (`confine`). With barriers on
        θ1 and θ3, of those in the range of eq. 5: then it is of motions that start there.
        """
        point = self.states[0] if self.proved and self.unique else None
        return 1 in self.closed and point is not None and point.index_proved and point.index == 0

    @property
    def every_start_of_range(self) -> bool:
        """Whether all motions from the range of eq. 5 converge to the only rest state: theorem 10.

        It needs barriers on θ1 and θ3 too, which keep these motions in the range.
        """
        return 0 in self.closed and self.every_start
