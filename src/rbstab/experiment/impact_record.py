"""Quantities of a run with a stop: its impacts, what they took away, and its rests."""

import numpy as np

from rbstab.integrate.impact_trace import ImpactTrace
from rbstab.mechanics.numbers import Array
from rbstab.systems.impact import stop_of
from rbstab.systems.system import System


def impact_arrays(system: System, impacts: ImpactTrace) -> dict[str, Array]:
    """Return the arrays of an impact trace; impacts and rests only if there are any.

    Args:
        system: The system, which has a stop.
        impacts: The trace.
    """
    stop = stop_of(system)
    assert stop is not None
    arrays = {
        "stop_angle": np.array(stop.angle),
        "impact_count": impacts.counts,
        "impact_loss": impacts.lost,
        "stop_contact": impacts.resting.astype(np.int8),
    }
    if len(impacts.times):
        arrays |= {"impact_time": impacts.times, "impact_rate": impacts.rates}
    if impacts.rests:
        arrays["rest_begin"], arrays["rest_end"] = np.array(impacts.rests).T
    return arrays
