"""The switches of an element: its event functions, and what it stores on both sides."""

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from rbstab.experiment.element_check.power import TOLERANCE, stored_slopes, wrench_at
from rbstab.experiment.element_check.states import Sample, own_in, with_modes
from rbstab.mechanics.derivatives import jacobian
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import OMEGA, THETA, V_OF_Z, X_OF_Z
from rbstab.systems.modes import guards_at, modes_of

BISECTIONS = 200
CONTINUOUS = 1e-9
"""The largest jump of the stored energy, relative to its size on the way."""

JUMP = 1e-6
"""A smaller jump of a force, relative to its size, is none: a switch is known to round-off."""


def guard_problems(sample: Sample) -> Iterator[str]:
    """Yield where an event function depends on the modes, or on velocities if the force jumps."""
    g = guards_at(sample.system, sample.y)
    flipped = with_modes(sample, 1.0 - np.array(modes_of(sample.system)))
    if not np.array_equal(g, guards_at(flipped.system, sample.y)):
        yield "`guards` depends on `mode`"
    slopes = jacobian(lambda y: guards_at(sample.system, y), sample.y)
    if np.any(slopes[:, OMEGA] != 0.0) or np.any(slopes[:, V_OF_Z] != 0.0):
        yield "`guards` depends on velocities, so its rate may jump at a switch"
    if np.any(own_in(sample.system, slopes.T) != 0.0):
        yield "`guards` depends on own states, so its rate may jump at a switch"


def kink_problems(sample: Sample) -> Iterator[str]:
    """Yield where an element is not what it says of itself by `kinked`."""
    if sample.element.kinked is not True:
        yield f"`kinked` is {sample.element.kinked!r} (expected True or False)"
    for index in range(sample.element.mode_count):
        found = [_stored(sample, sample.y, index, mode) for mode in (0.0, 0.5, 1.0)]
        size = np.abs(found).sum() + TOLERANCE
        if not abs(found[1] - 0.5 * (found[0] + found[2])) <= CONTINUOUS * size:
            yield f"`stored` is not linear in `mode[{index}]`, as `kinked = True` requires"


def force_jumps(one: Sample, other: Sample) -> bool:
    """Return whether the force on a body at rest jumps at a switch between two states.

    With own states, it is the slope of the stored energy by the pose: the wrench may also jump
    while own states are on their way to where they rest.
    """
    return any(_jumps(one, other, _force_at_rest, JUMP))


def jump_problems(one: Sample, other: Sample) -> Iterator[str]:
    """Yield where the stored energy jumps at a switch between two states of one element."""
    for number, (first, second) in _jumps(one, other, _stored, CONTINUOUS):
        yield (
            f"`stored` jumps where event function {number} is 0: {first:.6g} J with mode 0, "
            f"{second:.6g} J with mode 1"
        )


def untested_switches(pairs: Sequence[tuple[Sample, Sample]]) -> list[int]:
    """Return the numbers of the event functions, from 1, that are zero between no two states."""
    count = pairs[0][0].element.mode_count
    return [
        index + 1
        for index in range(count)
        if all(_switch_between(one, other, index) is None for one, other in pairs)
    ]


def _jumps(
    one: Sample, other: Sample, of: Callable[[Sample, Array, int, float], Array], most: float
) -> Iterator[tuple[int, Array]]:
    """Yield the number of each event function at whose zero between two states a value jumps.

    With it come the values with mode 0 and with mode 1. A jump is larger than `most` relative to
    the size of the value on both ways: at the switch itself it may be zero to round-off.
    """
    for index in range(one.element.mode_count):
        y = _switch_between(one, other, index)
        if y is None:
            continue
        sides, *ends = (
            np.array([of(one, z, index, mode) for mode in (0.0, 1.0)]) for z in (y, one.y, other.y)
        )
        size = np.abs([sides, *ends]).max() + TOLERANCE
        if not np.abs(sides[1] - sides[0]).max() <= most * size:
            yield index + 1, sides


def _with_mode(sample: Sample, y: Array, index: int, mode: float) -> Sample:
    """Return a sample in the modes of a state, but for one of them."""
    modes = (guards_at(sample.system, y) > 0).astype(float)
    modes[index] = mode
    return with_modes(sample, modes)


def _force_at_rest(sample: Sample, y: Array, index: int, mode: float) -> Array:
    """Return the force on a body at rest in the pose of a state, with one mode of a value."""
    y = y.copy()
    y[OMEGA], y[V_OF_Z] = 0.0, 0.0
    fixed = _with_mode(sample, y, index, mode)
    if not sample.element.state_size:
        return np.concatenate(wrench_at(fixed, y))
    slopes = stored_slopes(fixed, y)
    return np.concatenate([slopes[THETA], slopes[X_OF_Z]])


def _stored(sample: Sample, y: Array, index: int, mode: float) -> Array:
    """Return the stored energy in a state with one mode of a value."""
    element = _with_mode(sample, y, index, mode).element
    return np.array(element.stored(sample.system.motion(y), own_in(sample.system, y)))


def _switch_between(one: Sample, other: Sample, index: int) -> Array | None:
    """Return a state between two others where an event function is zero; None if there is none."""

    def guard(y: Array) -> float:
        return float(guards_at(one.system, y)[index])

    low, high = sorted((one.y, other.y), key=guard)
    if not guard(low) < 0 < guard(high):
        return None
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if guard(middle) > 0 else (middle, high)
    return low
