"""The text of a result that names the rest state at which its Lyapunov function is zero."""

from typing import TYPE_CHECKING

from rbstab.analysis.approached_state import LyapunovZero
from rbstab.mechanics.numbers import Array

if TYPE_CHECKING:
    from rbstab.experiment.proof import Proof

APPROACHED = "the rest state that the motion approaches"
"""The begin of the text if the motion approaches the state."""


def zero_description(zero: LyapunovZero) -> str:
    """Return a text that names the state at which v is zero, and says whether a lower one exists.

    Args:
        zero: The state.
    """
    if not zero.rest.is_at_rest:
        return "no rest state was found in the range of eq. 5"
    if not zero.approached:
        return (
            "the rest state nearest to the unloaded position; none was found that the motion "
            "approaches"
        )
    outside = "" if zero.rest.found else ", outside the range of eq. 5"
    return f"{APPROACHED}{outside}; {'no' if zero.is_lowest else 'a'} lower one is known"


def described_by_proof(text: str, Theta: Array, proof: "Proof | None") -> str:
    """Return a text of `zero_description` with what a proof says about the state.

    Args:
        text: The text.
        Theta: Θ of the state, shape (3,), rad.
        proof: The proof of the config, if there is one.
    """
    if proof is None or not text.startswith(APPROACHED):
        return text
    # Imported late: most runs have no proof.
    from rbstab.experiment.proof import number_of

    number = number_of(proof, Theta)
    if number is None:
        return text
    name, count = text.partition(";")[0], len(proof.states)
    if count == 1:
        return f"{name}; proved to be the only one in the range of eq. 5"
    return f"{name}; number {number} of the {count} in the range of eq. 5, the lowest first"
