"""The starts that a proof covers: whether the motion from a start converges, and where to."""

from collections.abc import Callable
from functools import partial
from itertools import product
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rbstab.analysis.approached_state import SAME_STATE
from rbstab.analysis.exact import ball, decimal_balls, in_balls, upper
from rbstab.experiment.stored_proof.entries import ProvedEnergy
from rbstab.experiment.stored_proof.proof import Proof, ProvedState, ProvedStates
from rbstab.integrate.problem import Problem
from rbstab.mechanics.attitude import tilt
from rbstab.mechanics.numbers import Array
from rbstab.systems.modes import guards_at, has_modes, with_modes
from rbstab.systems.system import System

if TYPE_CHECKING:
    from rbstab.proof.regions.starts import StartRegions

OPEN_RANGE = np.array([np.pi, np.pi / 2, np.pi])
"""rad: the largest doubles inside the open range of eq. 5: they are below π and π/2."""

START_RANGE = np.array([np.inf, np.pi / 2, np.inf])
"""rad: the same for all real θ1 and θ3."""


def has_no_rest_state(proof: Proof) -> bool:
    """Return whether it is proved that there is no rest state with |θ2| < π/2.

    Never of a tied body with springs: it may balance where a spring has no length.
    """
    wide = proof.unwrapped
    return not proof.needs_lengths and wide is not None and wide.proved and not wide.states


def start_level(problem: Problem, proof: Proof) -> float | None:
    """Return v(0) of a problem, J: the energy at the start minus that of the lowest rest state.

    Returns:
        v(0); None if no rest state is known.
    """
    if not proof.states:
        return None
    return float(_start_energies(problem).sum()) - proof.states[0].energy


def number_of(proof: Proof, Theta: Array) -> int | None:
    """Return the number of a rest state among those of a proof, from 1 for the lowest.

    Args:
        proof: The proof.
        Theta: Θ of the rest state, shape (3,), rad, as computed.

    Returns:
        The number; None if it is not one of them, or if they are not proved to be all.
    """
    if not proof.proved:
        return None
    for number, state in enumerate(proof.states, start=1):
        if proof.on_rotations is None:
            away = np.abs(Theta - state.orientation).max()
        else:
            away = tilt(Theta[None], np.array(state.orientation))[0]
        if away < SAME_STATE:
            return number
    return None


def start_state(problem: Problem, proof: Proof) -> int | None:
    """Return the number of the rest state to which the motion of a problem converges, proved.

    The energy and Θ at the start are enclosed for the exact numbers of the config. A start whose
    energy is no number in doubles is never inside.

    Returns:
        The number, from 1 for the lowest; None if it is not proved.
    """
    if not np.isfinite(_start_energies(problem).sum()):
        return None
    if not proof.has_energy or problem.exact is None:
        return None
    start = in_balls(partial(enclosed_start, problem.exact))
    if start is None:
        return None
    return reached_state(proof, start.energy, start.low, start.high)


def reached_state(proof: Proof, energy: float, low: Array, high: Array) -> int | None:
    """Return the number of the rest state to which every motion of a set converges, proved.

    The set has all motions that at some time have a total energy of at most `energy`, and Θ in a
    box. As the kinetic energy is not negative, U(Θ) <= energy there.

    Args:
        proof: The proof.
        energy: An upper bound of kinetic plus stored energy, J. Nothing is proved if it is not
            finite.
        low: The lower corner of the box of Θ, shape (3,), rad.
        high: The upper corner.

    Returns:
        The number, from 1 for the lowest; None if it is not proved.
    """
    if not np.isfinite(energy):
        return None
    if proof.every_start and proof.within_barriers:
        inside = np.all(low >= -OPEN_RANGE) and np.all(low <= high) and np.all(high <= OPEN_RANGE)
        return 1 if inside else None
    if proof.on_rotations is not None:
        below = proof.region is not None and _is_below(energy, proof.region.energy_bound)
        return 1 if below else None
    number = _reached(proof, proof, OPEN_RANGE, energy, (low, high))
    wide = proof.unwrapped
    if number is not None or wide is None or wide.end is None:
        return number
    if proof.every_start:
        inside = np.all(low >= -START_RANGE) and np.all(low <= high) and np.all(high <= START_RANGE)
        return same_state(proof, wide.states[0]) if inside else None
    end = np.array([wide.end[0], OPEN_RANGE[1], wide.end[2]])
    found = _reached(proof, wide, end, energy, (low, high))
    return None if found is None else same_state(proof, wide.states[found - 1])


def _reached(
    proof: Proof, states: ProvedStates, end: Array, energy: float, box: tuple[Array, Array]
) -> int | None:
    """Return the number of the rest state in one range that every motion of a set approaches."""
    low, high = box
    inside = np.all(low >= -end) and np.all(low <= high) and np.all(high <= end)
    if not inside or not proof.has_energy:
        return None
    if states.region is not None and _is_below(energy, states.region.energy_bound):
        return 1
    if not any(_is_below(energy, region.energy_bound) for region in states.regions):
        return None
    regions = start_regions(proof, states)
    if regions is None:
        return None
    (k,) = regions.find(np.array([energy]), low[np.newaxis], high[np.newaxis])
    return None if k < 0 else states.regions[k].rest_state


START_REGIONS = "start_regions"
"""The name under which the rest states of a proof keep their regions for starts."""


def start_regions(proof: Proof, states: ProvedStates) -> "StartRegions | None":
    """Return the regions of the minima in one range of a proof; None if there are none.

    Args:
        proof: The proof.
        states: Its rest states in this range.
    """
    if proof.reduced_energy is None or states.end is None or not states.regions:
        return None
    kept = vars(states)
    if START_REGIONS not in kept:
        # It is no field, as `Proof.of` has it.
        kept[START_REGIONS] = _made_regions(proof.reduced_energy, states, np.array(states.end))
    found: StartRegions = kept[START_REGIONS]
    return found


def _made_regions(stored: ProvedEnergy, states: ProvedStates, end: Array) -> "StartRegions":
    from rbstab.proof.regions.starts import RegionLevel, StartRegions
    from rbstab.proof.search import Box, Zero, Zeros, joined, one_box

    zeros = []
    for state in states.states:
        low, high = np.array(state.enclosure)
        point, enclosure = np.array(state.orientation), Box(low, high)
        index = state.index if state.index_proved else None
        zeros.append(Zero(point, enclosure, enclosure, index, state.energy))
    undecided = [one_box(Box(*map(np.array, corners))) for corners in states.undecided]
    levels = [RegionLevel(one.rest_state - 1, one.energy_bound) for one in states.regions]
    listed = Zeros(tuple(zeros), joined(undecided, 3), 0)
    return StartRegions(stored.energy, listed, Box(-end, end), levels)


def same_state(proof: Proof, state: ProvedState) -> int | None:
    """Return the number of a proved rest state among those of a proof in the range of eq. 5.

    Of two boxes that contain exactly one rest state each, one inside the other, both contain the
    same.
    """
    low, high = np.array(state.enclosure)
    for number, other in enumerate(proof.states, start=1):
        other_low, other_high = np.array(other.enclosure)
        nested = np.all(other_low <= low) and np.all(high <= other_high)
        nested = nested or (np.all(low <= other_low) and np.all(other_high <= high))
        if other.proved and state.proved and nested:
            return number
    return None


def _is_below(energy: float, bound: float | None) -> bool:
    return bound is not None and energy < bound


class EnclosedStart(NamedTuple):
    """Bounds on the energy at a start, J, and on Θ, shape (3,) each, rad."""

    least: float
    energy: float
    low: Array
    high: Array


def enclosed_start(
    exact: Callable[[Callable[[Array], Array]], tuple[System, Array]],
) -> EnclosedStart:
    """Return bounds on the energy at the start, and a box of Θ; call it by `in_balls`."""
    system, start = exact(decimal_balls)
    energies = [
        sum(one.observe(start).energy.tolist(), ball(0.0)) for one in _in_modes(system, start)
    ]
    Theta = [ball(0.0) + angle for angle in system.motion(start).Theta]
    low, high = [-upper(-angle) for angle in Theta], [upper(angle) for angle in Theta]
    return EnclosedStart(
        # Unlike those of Python, these keep what is no number.
        float(np.min([-upper(-one) for one in energies])),
        float(np.max([upper(one) for one in energies])),
        np.array(low),
        np.array(high),
    )


def _in_modes(system: System, start: Array) -> list[System]:
    """Return a system in the modes of a start in balls; in both where it is not known in which."""
    if not has_modes(system):
        return [system]
    choices = [
        (1.0,) if g > 0 else (0.0,) if g < 0 else (0.0, 1.0)
        for g in (ball(0.0) + g for g in guards_at(system, start))
    ]
    return [with_modes(system, modes) for modes in product(*choices)]


def _start_energies(problem: Problem) -> Array:
    """Return the energy at the start by part, shape (parts,), J."""
    with np.errstate(all="ignore"):
        return problem.system.observe(problem.start).energy
