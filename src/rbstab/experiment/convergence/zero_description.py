"""The text of a result that names the rest state at which its Lyapunov function is zero."""

from typing import TYPE_CHECKING

import numpy as np

from rbstab.analysis.approached_state import SAME_STATE, LyapunovZero
from rbstab.experiment.summary import NO_REST_STATE, is_driven, moves_on_in, settling_time_of
from rbstab.mechanics.numbers import Array
from rbstab.store.result import Result
from rbstab.systems.system import System

if TYPE_CHECKING:
    from rbstab.experiment.stored_proof.proof import Proof

NOT_LOWEST = "a lower one is known"
"""The end of the text if the state is not the lowest one that is known."""

APPROACHED = "the rest state that the motion approaches"
"""The begin of the text if the motion was seen, or is proved, to come to rest there."""

BELOW_END = "the rest state below the end of the motion"
"""The begin of the text if only a descent in energy from the end leads there."""

AT_END = "the pose at the end of the motion, which moves on"
"""The text if the body moves on without damping where no energy falls."""


OUTSIDE = ", outside the range of eq. 5"
"""Follows if this state has other angles."""

UNSTABLE = ", an unstable one"
"""Follows if the stored energy falls in some direction from this state."""


def zero_description(zero: LyapunovZero, run: Result, *, unstable: bool = False) -> str:
    """Return a text that names the state at which v is zero, and says whether a lower one exists.

    Args:
        zero: The state.
        run: The run, by its arrays.
        unstable: Whether the stored energy falls in some direction from it.
    """
    if not zero.rest.is_at_rest:
        return NO_REST_STATE
    if not zero.approached:
        return (
            "the rest state nearest to the unloaded position; none was found below the end of the "
            "motion"
        )
    outside = f"{'' if zero.rest.rests_in_range else OUTSIDE}{UNSTABLE if unstable else ''}"
    moved = [run[name][-1] - run[f"rest_{name}"] for name in ("orientation", "position")]
    if moves_on_in(run) and np.abs(moved).max() < SAME_STATE:
        return AT_END
    name = BELOW_END if np.isnan(settling_time_of(run)) else APPROACHED
    if is_driven(run):
        name = "the rest state without inputs, below the end of the motion"
    return f"{name}{outside}; {'no lower one is known' if zero.is_lowest else NOT_LOWEST}"


def is_below_end(text: str) -> bool:
    """Return whether v of a run is zero at the rest state below its end, by its description."""
    return text.startswith((APPROACHED, BELOW_END))


def no_rest_state_warning(system: System) -> str:
    """Return the warning that no rest state of a system was found, and perhaps why."""
    users = (element for element in system.elements if element.from_user and element.mode_count)
    names = [element.name for element in users if not element.kinked]
    if not names:
        return NO_REST_STATE
    hint = "if its force jumps at a switch, declare `kinked = True` in its class"
    return f"{NO_REST_STATE} ({', '.join(names)}: {hint}; `rbstab check --element` tells)"


def described_by_proof(
    text: str, Theta: Array, proof: "Proof | None", reached: int | None = None
) -> str:
    """Return a text of `zero_description` with what a proof says about the state.

    Args:
        text: The text.
        Theta: Θ of the state, shape (3,), rad.
        proof: The proof of the config, if there is one.
        reached: The number of the rest state to which the exact motion converges, if it is proved.
    """
    count = 0 if proof is None else len(proof.states)
    if count and text.startswith(NO_REST_STATE):
        return (
            f"{NO_REST_STATE} by a descent in energy from the unloaded position; a longer search "
            f"knows {count}, and v counts from none of them"
        )
    if proof is None or not is_below_end(text):
        return text
    # Imported late: most runs have no proof.
    from rbstab.experiment.stored_proof.starts import number_of

    if reached is not None:
        away = np.abs(Theta - proof.states[reached - 1].orientation).max()
        text = text.replace(BELOW_END, APPROACHED) if away < SAME_STATE else text
    number = number_of(proof, Theta)
    if number is None:
        return text
    name, place = text.partition(";")[0], "in the range of eq. 5"
    if proof.on_rotations is not None:
        place = proof.place
    if count == 1:
        return f"{name}; proved to be the only one {place}"
    return f"{name}; number {number} of the {count} {place}, the lowest first"
