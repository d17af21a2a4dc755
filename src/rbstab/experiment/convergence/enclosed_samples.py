"""The enclosure of the exact motion at the samples of a run, and the computed motion beside it."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from rbstab.analysis.certificate.verdict import Check, Verdict
from rbstab.mechanics.numbers import Array
from rbstab.store.variables import Variable
from rbstab.systems.quantities import quantities_with
from rbstab.systems.system import System

GROUP = "enclosure"
"""The name of the group of a result file that holds the enclosure."""

COMPUTED_MOTION = "computed motion"
"""The name of the check that compares the computed motion with the exact one."""

SMALLEST_SIZE = 1e-9
"""Differences are divided by the largest value of a quantity, or by this number of its unit."""

BODY_QUANTITIES = {
    "Z": ("orientation", "angular_velocity", "position", "velocity"),
    "W": ("orientation", "angular_velocity", "contact_displacement", "contact_velocity"),
    "reduced": ("orientation", "angular_velocity"),
}
"""The quantities of the body's part of a state vector, each of length 3, by coordinates."""


class EnclosedSamples(NamedTuple):
    """Bounds on the exact motion at the samples of a run, as far as it was enclosed.

    Attributes:
        times: Shape (m,), s.
        low: The smallest value of each quantity by its name, shape (m, 3) or (m, size).
        high: The largest one.
    """

    times: Array
    low: dict[str, Array]
    high: dict[str, Array]


def quantities_of(system: System) -> dict[str, slice]:
    """Return the places of the quantities of a system in its state vector, by their names."""
    names = BODY_QUANTITIES[system.coordinates.name]
    body = {name: slice(3 * k, 3 * k + 3) for k, name in enumerate(names)}
    return body | system.own_states


def enclosure_variables(samples: EnclosedSamples, system: System) -> dict[str, Variable]:
    """Return the enclosure of a motion of a system as arrays of the group `enclosure`."""
    quantities = quantities_with(system.declared_states)
    variables = {f"{GROUP}/time": Variable(("time",), samples.times, "s", "time from the start")}
    for name in samples.low:
        quantity = quantities[name]
        dimension = quantity.dimensions[1]
        size = samples.low[name].shape[1]
        number = Variable((dimension,), np.arange(1, size + 1), "1", "component of a vector")
        variables[f"{GROUP}/{dimension}"] = number
        for side, word in (("low", "smallest"), ("high", "largest")):
            long_name = f"{quantity.symbol} of the exact motion: proved {word} value"
            data = getattr(samples, side)[name]
            dimensions = ("time", dimension)
            variables[f"{GROUP}/{name}_{side}"] = Variable(
                dimensions, data, quantity.unit, long_name
            )
    return variables


def computed_motion_check(
    samples: EnclosedSamples, variables: Mapping[str, Variable], bound: float
) -> Check:
    """Check that the computed motion is near the exact one, at all samples that are enclosed.

    Where the enclosure is wider than the bound, only what is proved of the distance counts: that of
    the computed value from the enclosure.

    Args:
        samples: The enclosure.
        variables: The arrays of the run.
        bound: The largest allowed difference, relative to the size of a quantity.
    """
    times = variables["time"].data
    count = min(len(times), len(samples.times))
    common = np.flatnonzero(times[:count] == samples.times[:count])
    distances = []
    for name in samples.low:
        data = variables[name].data
        size = max(float(np.abs(data[common]).max(initial=0.0)), SMALLEST_SIZE)
        low, high = samples.low[name][common], samples.high[name][common]
        # The distance of the computed value from the exact one: the largest, and the smallest.
        most = np.maximum(np.abs(data[common] - low), np.abs(high - data[common]))
        least = np.maximum(np.maximum(low - data[common], data[common] - high), 0.0)
        distance = np.where(high - low <= bound * size, most, least)
        distances.append(distance.max(axis=1, initial=0.0) / size)
    # The first sample is always enclosed. A NaN is the largest, and above the bound.
    relative = np.max(distances, axis=0)
    row = int(relative.argmax())
    worst, when = float(relative[row]), float(times[common[row]])
    verdict = Verdict.CONSISTENT if worst <= bound else Verdict.VIOLATED
    quantity = f"max distance from the exact motion / size, to {times[common[-1]]:.4g} s"
    return Check(COMPUTED_MOTION, verdict, worst, bound, when, quantity)
