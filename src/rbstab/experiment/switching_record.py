"""Quantities of a run that switches: chatter of a sliding connector, impacts against a stop."""

import numpy as np

from rbstab.integrate.traces import ImpactTrace, SwitchTrace
from rbstab.mechanics.numbers import Array
from rbstab.systems.impact import stop_of
from rbstab.systems.system import System


def switching_arrays(switches: SwitchTrace) -> dict[str, Array]:
    """Return the arrays of a switch trace; switches and transitions only if there are any."""
    arrays = {
        "mode": switches.modes.astype(np.int8),
        "switch_count": switches.counts,
        "chatter_energy": switches.chatter_energy,
        "discarded_energy": switches.discarded_energy,
        "trusted_until": np.array(switches.trusted_until),
    }
    if len(switches.switch_times):
        arrays["switch_time"] = switches.switch_times
        arrays["switch_axis"] = switches.switch_axes + 1
    if switches.transitions:
        times, axes, kinds = zip(*switches.transitions, strict=True)
        arrays["transition_time"] = np.array(times)
        arrays["transition_axis"] = np.array(axes) + 1
        arrays["transition_kind"] = np.array([str(kind) for kind in kinds], dtype=object)
    return arrays


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
