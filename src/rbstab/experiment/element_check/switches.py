"""The switches of an element: its event functions, and what it stores on both sides."""

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

from rbstab.experiment.element_check.power import TOLERANCE
from rbstab.experiment.element_check.states import Sample, own_in, with_modes
from rbstab.mechanics.derivatives import jacobian
from rbstab.mechanics.numbers import Array, Number
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
        found = [_stored_with(sample, sample.y, index, mode) for mode in (0.0, 0.5, 1.0)]
        size = sum(map(abs, found)) + TOLERANCE
        if not abs(found[1] - 0.5 * (found[0] + found[2])) <= CONTINUOUS * size:
            yield f"`stored` is not linear in `mode[{index}]`, as `kinked = True` requires"


def force_jumps(one: Sample, other: Sample) -> bool:
    """Return whether the force on a body at rest jumps at a switch between two states.

    With own states, it is the slope of the stored energy by the pose: the wrench may also jump
    while own states are on their way to where they rest.
    """
    for index in range(one.element.mode_count):
        y = _switch_between(one, one.y, other.y, index)
        if y is None:
            continue
        sides = _forces_at_rest(one, y, index)
        # At the switch both may be zero to round-off, so what counts is their size on both ways.
        ends = [_forces_at_rest(one, z, index) for z in (one.y, other.y)]
        size = np.abs([sides, *ends]).max() + TOLERANCE
        if not np.abs(sides[1] - sides[0]).max() <= JUMP * size:
            return True
    return False


def untested_switches(pairs: Sequence[tuple[Sample, Sample]]) -> list[int]:
    """Return the numbers of the event functions, from 1, that are zero between no two states."""
    count = pairs[0][0].element.mode_count
    return [
        index + 1
        for index in range(count)
        if all(_switch_between(one, one.y, other.y, index) is None for one, other in pairs)
    ]


def jump_problems(one: Sample, other: Sample) -> Iterator[str]:
    """Yield where the stored energy jumps at a switch between two states of one element."""
    for index in range(one.element.mode_count):
        y = _switch_between(one, one.y, other.y, index)
        if y is None:
            continue
        energies = [_stored_with(one, y, index, mode) for mode in (0.0, 1.0)]
        # At the switch it may be zero to round-off, so what counts is its size on both ways to it.
        ends = [_stored_with(one, z, index, mode) for z in (one.y, other.y) for mode in (0.0, 1.0)]
        size = sum(map(abs, [*energies, *ends])) + TOLERANCE
        if not abs(energies[1] - energies[0]) <= CONTINUOUS * size:
            yield (
                f"`stored` jumps where event function {index + 1} is 0: {energies[0]:.6g} J with "
                f"mode 0, {energies[1]:.6g} J with mode 1"
            )


def _forces_at_rest(sample: Sample, y: Array, index: int) -> Array:
    """Return the forces on a body at rest in a pose, with mode 0 and with mode 1, one in a row."""
    y = y.copy()
    y[OMEGA], y[V_OF_Z] = 0.0, 0.0
    modes = (guards_at(sample.system, y) > 0).astype(float)
    found = []
    for mode in (0.0, 1.0):
        modes[index] = mode
        fixed = with_modes(sample, modes.copy())
        if sample.element.state_size:
            slopes = jacobian(partial(_stored_at, fixed), y)
            found.append(np.concatenate([slopes[THETA], slopes[X_OF_Z]]))
        else:
            motion, own = sample.system.motion(y), own_in(sample.system, y)
            found.append(np.concatenate(fixed.element.wrench(motion, own)))
    return np.array(found)


def _stored_at(sample: Sample, y: Array) -> Number:
    """Return the stored energy in a state, with the modes of the sample."""
    found: Number = sample.element.stored(sample.system.motion(y), own_in(sample.system, y))
    return found


def _stored_with(sample: Sample, y: Array, index: int, mode: float) -> float:
    """Return the stored energy in a state with one mode of another value."""
    modes = (guards_at(sample.system, y) > 0).astype(float)
    modes[index] = mode
    element = with_modes(sample, modes).element
    return float(element.stored(sample.system.motion(y), own_in(sample.system, y)))


def _switch_between(sample: Sample, one: Array, other: Array, index: int) -> Array | None:
    """Return a state between two others where an event function is zero; None if there is none."""

    def guard(y: Array) -> float:
        return float(guards_at(sample.system, y)[index])

    low, high = (one, other) if guard(one) <= guard(other) else (other, one)
    if not guard(low) < 0 < guard(high):
        return None
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if guard(middle) > 0 else (middle, high)
    return low
