"""Quantities of a run with events: chatter of a sliding connector, impacts against a stop."""

import numpy as np

from rbstab.integrate.problem import Trajectory
from rbstab.mechanics.numbers import Array
from rbstab.systems.impact import stop_of
from rbstab.systems.system import System


def event_arrays(system: System, trajectory: Trajectory) -> dict[str, Array]:
    """Return the arrays of the events of a run; those that list events only if there are any."""
    arrays: dict[str, Array] = {}
    switches, impacts, stop = trajectory.switches, trajectory.impacts, stop_of(system)
    if switches is not None:
        arrays |= {
            "mode": switches.modes.astype(np.int8),
            "switch_count": switches.counts,
            "chatter_energy": switches.chatter_energy,
            "discarded_energy": switches.discarded_energy,
        }
        if len(switches.switch_times):
            arrays |= {
                "switch_time": switches.switch_times,
                "switch_axis": switches.switch_axes + 1,
            }
        if switches.transitions:
            times, axes, kinds = zip(*switches.transitions, strict=True)
            arrays |= {
                "transition_time": np.array(times),
                "transition_axis": np.array(axes) + 1,
                "transition_kind": np.array([str(kind) for kind in kinds], dtype=object),
            }
    if trajectory.trusted_until is not None:
        arrays["trusted_until"] = np.array(trajectory.trusted_until)
    if impacts is not None and stop is not None:
        arrays |= {
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
