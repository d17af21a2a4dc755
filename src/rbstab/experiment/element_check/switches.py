"""The switches of an element: its event functions, and what it states on both sides."""

from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise, product
from typing import Any, NamedTuple

import numpy as np

from rbstab.experiment.element_check.probes import TOLERANCE
from rbstab.experiment.element_check.states import Sample, element_states_in, statements
from rbstab.mechanics.derivatives import jacobian
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import OMEGA, THETA, V_OF_Z, X_OF_Z
from rbstab.systems.modes import guards_at, modes_of

BISECTIONS = 200
CONTINUOUS = 1e-9
"""The largest jump of the stored energy, relative to its size on the way."""

JUMP = 1e-6
"""A smaller jump of a force, relative to its size, is none: a switch is known to round-off."""


class Switch(NamedTuple):
    """A state at which an event function is zero.

    Attributes:
        event: The number of the event function, from 0.
        samples: The state, and two others on both sides of it, in the system of the first of these.
    """

    event: int
    samples: tuple[Sample, Sample, Sample]

    def sides(self, value: Callable[[Sample], Array], most: float) -> Array | None:
        """Return a value at the switch in mode 0 and in mode 1; None if it does not jump.

        A jump is larger than `most` relative to the size of the value on both ways: at the switch
        itself it may be zero to round-off.
        """
        values = np.array(
            [[value(_in_mode(s, self.event, mode)) for mode in (0.0, 1.0)] for s in self.samples]
        )
        sides, size = values[0], np.abs(values).max() + TOLERANCE
        return None if np.abs(sides[1] - sides[0]).max() <= most * size else sides


def switches_between(samples: Sequence[Sample]) -> list[Switch]:
    """Return the switches between the states of samples that follow each other."""
    switches = []
    for (sample, next_sample), index in product(
        pairwise(samples), range(samples[0].element.mode_count)
    ):

        def event(y: Array, system: Any = sample.system, index: int = index) -> float:
            return float(guards_at(system, y)[index])

        low, high = sorted((sample.y, next_sample.y), key=event)
        if event(low) < 0 < event(high):
            for _ in range(BISECTIONS):
                middle = 0.5 * (low + high)
                low, high = (low, middle) if event(middle) > 0 else (middle, high)
            switches.append(
                Switch(index, (sample._replace(y=low), sample, sample._replace(y=next_sample.y)))
            )
    return switches


def stored(sample: Sample) -> Array:
    """Return the stored energy, in the modes of a sample."""
    return statements(sample.system, sample.y)["stored"]


def force_at_rest(sample: Sample) -> Array:
    """Return the force on a body at rest.

    With own states, it is the slope of the stored energy by the pose: the wrench may also jump
    while own states are on their way to where they rest.
    """
    rest = sample.resting
    if not sample.element.state_size:
        return statements(rest.system, rest.y)["wrench"]
    slopes = rest.stored_slopes
    return np.concatenate([slopes[THETA], slopes[X_OF_Z]])


def jump_problems(switches: Sequence[Switch]) -> Iterator[str]:
    """Yield where the stored energy jumps at a switch."""
    for switch in switches:
        sides = switch.sides(stored, CONTINUOUS)
        if sides is not None:
            yield (
                f"`stored` jumps where event function {switch.event + 1} is 0: {sides[0, 0]:.6g} J "
                f"with mode 0, {sides[1, 0]:.6g} J with mode 1; {switch.samples[1].words}"
            )


def guard_problems(sample: Sample) -> Iterator[str]:
    """Yield where an event function depends on the modes, or on velocities if the force jumps."""
    flipped = sample.in_modes(1.0 - np.array(modes_of(sample.system)))
    if np.any(guards_at(sample.system, sample.y) != guards_at(flipped.system, sample.y)):
        yield "`guards` depends on `mode`"
    slopes = jacobian(lambda y: guards_at(sample.system, y), sample.y)
    for what, some in (
        ("velocities", (slopes[:, OMEGA], slopes[:, V_OF_Z])),
        ("own states", (element_states_in(sample.system, slopes.T),)),
    ):
        if any(np.any(slope != 0.0) for slope in some):
            yield f"`guards` depends on {what}, so its rate may jump at a switch"


def kink_problems(sample: Sample) -> Iterator[str]:
    """Yield where an element is not what it says of itself by `kinked`."""
    if sample.element.kinked is not True:
        yield f"`kinked` is {sample.element.kinked!r} (expected True or False)"
    for index in range(sample.element.mode_count):
        low, middle, high = (stored(_in_mode(sample, index, mode)) for mode in (0.0, 0.5, 1.0))
        size = np.abs([low, middle, high]).sum() + TOLERANCE
        if not np.abs(middle - 0.5 * (low + high)) <= CONTINUOUS * size:
            yield f"`stored` is not linear in `mode[{index}]`, as `kinked = True` requires"


def _in_mode(sample: Sample, index: int, mode: float) -> Sample:
    """Return a sample in the modes of its state, but for one of them."""
    modes = (guards_at(sample.system, sample.y) > 0).astype(float)
    modes[index] = mode
    return sample.in_modes(modes)
