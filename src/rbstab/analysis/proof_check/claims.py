"""What a proof claims of one rest state, whatever its energy is, and the checks of these claims."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from flint import arb

from rbstab.analysis.proof_check.boxes import AXES, Box
from rbstab.analysis.proof_check.findings import Range


@dataclass(frozen=True)
class RestState:
    """One rest state of a proof.

    Attributes:
        number: From 1.
        index: The number of negative eigenvalues of the Hessian.
        index_proved: Whether the proof claims the index.
        point: Θ, rad.
        enclosure: The box that is claimed to contain exactly one zero of the gradient: of Θ, or of
            Θ and z for a tied body with springs.
        held: Whether it is claimed that a force holds the body where it jumps: that of a guard at
            its angle of θ2, or of an element of a user.
        ridge: Whether this force is claimed to push away from there.
    """

    number: int
    index: int
    index_proved: bool
    point: Sequence[float]
    enclosure: Box
    held: bool = False
    ridge: bool = False

    @property
    def name(self) -> str:
        """Its name in sentences."""
        return f"rest state {self.number}"

    @property
    def is_minimum(self) -> bool:
        """Whether the proof claims that it is a minimum."""
        return self.index_proved and self.index == 0


def fault_of(
    state: RestState,
    range_: Range,
    *,
    unique: Callable[[], bool],
    exists: Callable[[], bool],
    index: Callable[[], int | None],
) -> str | None:
    """Return what is wrong with a rest state, or None.

    Args:
        state: The rest state.
        range_: The range in which its enclosure must be.
        unique: Returns whether the enclosure has at most one zero of the gradient, because all
            Hessians in it are regular.
        exists: Returns whether it has one at least.
        index: Returns the index of one of these Hessians, which then is that of all; None if it is
            not known.
    """
    pairs = zip(state.enclosure, state.point, strict=False)  # Θ comes first
    if not all(low <= angle <= high for (low, high), angle in pairs):
        return "its Θ is not in its enclosure"
    ends = [max(-low, high) for low, high in state.enclosure]
    if not all(arb(ends[i]) < range_.ends[i] for i in AXES):
        return f"its enclosure is not inside {range_.name}"
    if not unique():
        return "its enclosure may contain more than one zero of the gradient"
    if not exists():
        return "no zero of the gradient could be shown in its enclosure"
    found = index()
    if state.index_proved and found != state.index:
        return f"its index is {'not known' if found is None else found}"
    return None
