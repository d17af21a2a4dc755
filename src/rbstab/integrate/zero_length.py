"""Find where the statements of an element end: where a spring has no length, and no direction."""

import numpy as np

from rbstab.integrate.status import RunStatus
from rbstab.integrate.watched_rates import StopRun
from rbstab.mechanics.numbers import Array
from rbstab.systems.system import System


def zero_length(name: str) -> StopRun:
    """Return what ends a run where a spring has no length."""
    return StopRun(RunStatus.ZERO_LENGTH, reason(name))


def reason(name: str) -> str:
    """Return why a run ends where a spring has no length, as text."""
    return f"{name} has no length, so its direction is undefined"


def ended_at(system: System, y: Array) -> str | None:
    """Return the name of an element whose statements are not defined at a state; None if none."""
    with np.errstate(all="ignore"):
        values = system.clearances(y)
    # A state that is not a number has other reasons.
    wrong = np.flatnonzero(values <= 0)
    return system.clearance_owners[wrong[0]] if len(wrong) else None
