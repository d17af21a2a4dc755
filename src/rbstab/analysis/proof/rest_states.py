"""A rest state of a system, as a proof or a search finds it."""

from dataclasses import dataclass

from rbstab.analysis.proof.boxes import Boxes
from rbstab.analysis.rest_state import RestState
from rbstab.mechanics.numbers import Array


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
