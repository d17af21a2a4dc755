"""The state of a heyoka integrator: its parameters, its motion, and steps that are made again.

An integrator is compiled once and serves many runs, so each run sets all of its state. A run also
goes back in it: heyoka's root isolation can miss a zero beside the start of a step. Such a step is
undone, and made again with a part of its length until the event is found.
"""

from typing import Any

from rbstab.mechanics.numbers import Array

STEP_REDUCTION = 16
"""A step that missed an event is repeated with its length divided by this."""

MIN_STEP = 1e-18
"""s: the run fails if a step shorter than this would be needed to find a missed event."""


def set_parameters(integrator: Any, values: Array) -> None:
    """Set the `par[]` of an integrator to the values of all parameters of its equations."""
    # heyoka has no `par[]` after the last one that the equations use.
    integrator.pars[:] = values[: len(integrator.pars)]


def set_motion(integrator: Any, time: float, state: Array) -> None:
    """Set the time, s, and the state of an integrator; it forgets the events before.

    heyoka takes an event soon after the last one of its function for the same event.
    """
    integrator.time = time
    set_state(integrator, state)


def set_state(integrator: Any, state: Array) -> None:
    """Set the state of an integrator at its time; see `set_motion`."""
    integrator.state[:] = state
    integrator.reset_cooldowns()


def shortened(made: float) -> float:
    """Return the length with which a step that missed an event is repeated, s.

    Args:
        made: The length of the step, s; negative if it was made backwards.
    """
    return abs(made) / STEP_REDUCTION
