"""The schedule of a run: when the legs of its inputs begin, and which legs they are.

Between two breakpoints each input has one leg, and the equations are smooth. The legs are
parameters of the system, as modes are. So an engine ends a step on each breakpoint, and goes on
with other parameters: one compilation serves all signals.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from rbstab.elements.inputs.signals import Leg
from rbstab.mechanics.numbers import Array
from rbstab.systems.system import System

LEG_FIELDS = tuple(field.name for field in fields(Leg))

BEGIN = LEG_FIELDS.index("begin")


@dataclass(frozen=True, eq=False)
class Schedule:
    """The legs of some inputs over time.

    Args:
        breakpoints: Where a leg of an input begins, shape (n,), s, ascending.
        names: The names of the inputs.
        legs: The legs of each input before the first breakpoint, and then from each of them on,
            shape (n + 1, inputs, 3), in the order of `LEG_FIELDS`; floats or complex numbers.
    """

    breakpoints: Array
    names: tuple[str, ...]
    legs: Array

    def legs_at(self, time: float) -> Array:
        """Return the leg of each input at a time, shape (inputs, 3); a new one at a breakpoint."""
        return self.legs[self.breakpoints.searchsorted(time, side="right")]

    def between(self, begin: float, end: float) -> list[float]:
        """Return the breakpoints after one time and before another, s."""
        inside = (self.breakpoints > begin) & (self.breakpoints < end)
        return self.breakpoints[inside].tolist()

    def system_at(self, system: System, time: float) -> System:
        """Return a system with the legs of a time."""
        legs = zip(self.names, self.legs_at(time).tolist(), strict=True)
        return with_legs(system, {name: Leg(*leg) for name, leg in legs})

    def places(self, offsets: Mapping[str, int]) -> Array:
        """Return the indices of the legs among all parameters, shape (inputs, 3).

        Args:
            offsets: The index of each parameter by its name (see `systems.parameters`).
        """
        names = [[f"{name}.signal.{part}" for part in LEG_FIELDS] for name in self.names]
        return np.array([[offsets[entry] for entry in row] for row in names])


def with_legs(system: System, legs: Mapping[str, Leg]) -> System:
    """Return a system whose inputs have other legs, by name; itself if there are none."""
    if not legs:
        return system
    given: tuple[Any, ...] = system.elements
    elements = [
        replace(element, signal=legs[element.name]) if element.name in legs else element
        for element in given
    ]
    return System(system.body, tuple(elements), system.coordinates, system.anchor)


def leg_parameters(system: System) -> frozenset[str]:
    """Return the names of the parameters that change at breakpoints (see `systems.parameters`)."""
    return frozenset(
        f"{element.name}.signal.{part}"
        for element in system.elements
        if isinstance(getattr(element, "signal", None), Leg)
        for part in LEG_FIELDS
    )


NO_LEGS = Schedule(np.zeros(0), (), np.zeros((1, 0, 3)))
"""The schedule without inputs."""


def schedule_of(signals: Mapping[str, Array]) -> Schedule:
    """Return the schedule of some inputs.

    Args:
        signals: The legs of each input by its name, shape (legs, 3), of floats or complex numbers,
            whose real parts tell when they begin. The first leg is also that before its beginning.
    """
    if not signals:
        return NO_LEGS
    times = np.unique(np.concatenate([legs[1:, BEGIN].real for legs in signals.values()]))
    starts = np.concatenate([[-np.inf], times])
    rows = [
        legs[legs[1:, BEGIN].real.searchsorted(starts, side="right")] for legs in signals.values()
    ]
    return Schedule(times, tuple(signals), np.stack(rows, axis=1))
