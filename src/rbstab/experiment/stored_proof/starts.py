"""The starts that a proof covers: whether the motion from a start converges, and where to."""

from collections.abc import Callable, Iterator
from functools import partial
from itertools import product
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rbstab.analysis.approached_state import SAME_STATE
from rbstab.analysis.exact import ball, decimal_balls, in_balls, upper
from rbstab.experiment.stored_proof.data import ProofData, ProvedStates
from rbstab.integrate.problem import Problem
from rbstab.mechanics.attitude import tilt
from rbstab.mechanics.numbers import Array
from rbstab.proof.entries import ProvedState
from rbstab.systems.modes import guards_at, has_modes, with_modes
from rbstab.systems.system import System

if TYPE_CHECKING:
    from rbstab.proof.regions.starts import StartRegions

OPEN_RANGE = np.array([np.pi, np.pi / 2, np.pi])
"""rad: the largest doubles inside the open range of eq. 5: they are below π and π/2."""

START_RANGE = np.array([np.inf, np.pi / 2, np.inf])
"""rad: the same for all real θ1 and θ3."""


def has_no_rest_state(proof: ProofData, *, at_poles: bool = False) -> bool:
    """Return whether it is proved that there is no rest state with |θ2| < π/2.

    Never of a tied body with springs: it may balance where a spring has no length; and never of
    motions that may go to θ2 = ±90° (`at_poles`): a rest state may be there.
    """
    wide = proof.unwrapped
    if at_poles:
        return False
    return not proof.needs_lengths and wide is not None and wide.proved and not wide.states


def start_level(problem: Problem, proof: ProofData) -> float | None:
    """Return v(0) of a problem, J: the energy at the start minus that of the lowest rest state.

    Returns:
        v(0); None if no rest state is known.
    """
    if not proof.states:
        return None
    with np.errstate(all="ignore"):
        energy = float(problem.system.observe(problem.start).energy.sum())
    return energy - proof.states[0].energy


def number_of(proof: ProofData, Theta: Array) -> int | None:
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


def start_state(problem: Problem, proof: ProofData) -> int | None:
    """Return the number of the rest state to which the motion of a problem converges, proved.

    The energy and Θ at the start are enclosed for the exact numbers of the config.

    Returns:
        The number, from 1 for the lowest; None if it is not proved.
    """
    start = start_bounds(problem) if proof.has_energy else None
    return start and reached_state(proof, start.energy, start.low, start.high)


def reached_state(proof: ProofData, energy: float, low: Array, high: Array) -> int | None:
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
    numbers, _ = reached_states(proof, np.array([energy]), low[np.newaxis], high[np.newaxis])
    return int(numbers[0]) or None


def reached_states(proof: ProofData, energy: Array, low: Array, high: Array) -> tuple[Array, Array]:
    """Return the same as `reached_state` for m sets, and the bounds on the energy of the regions.

    Args:
        proof: The proof.
        energy: Shape (m,), J.
        low: Shape (m, 3), rad.
        high: Shape (m, 3), rad.

    Returns:
        The numbers, 0 where it is not proved, and the bound of the region in which each set is, J:
        above its energy, and infinite where every start converges; both of shape (m,).
    """
    reached, bounds = np.zeros(len(energy), dtype=np.int32), np.full(len(energy), -np.inf)
    for states, end, lowest in _ranges(proof):
        within = (reached == 0) & np.isfinite(energy)
        if end is not None:
            within &= np.all((low >= -end) & (low <= high) & (high <= end), axis=1)
        rows = np.flatnonzero(within)
        levels = np.array([lowest, *(region.energy_bound for region in states.regions), -np.inf])
        place = np.where(energy[rows] < lowest, 0, -1)
        left = np.flatnonzero((place < 0) & (energy[rows] < levels.max()))
        regions = start_regions(proof, states) if len(left) else None
        if regions is not None:
            some = rows[left]
            inside = regions.find(energy[some], low[some], high[some])
            place[left] = np.where(inside < 0, -1, inside + 1)
        numbers = [1, *(region.rest_state for region in states.regions), 0]
        if states is not proof:
            numbers = [n and (same_state(proof, states.states[n - 1]) or 0) for n in numbers]
        reached[rows], bounds[rows] = np.array(numbers)[place], levels[place]
    return reached, bounds


def region_bounds(proof: ProofData) -> list[float]:
    """Return the bounds on the energy of all regions of a proof, J; infinite for every start."""
    bounds = [
        bound
        for states, _, lowest in _ranges(proof)
        for bound in (lowest, *(region.energy_bound for region in states.regions))
    ]
    return [bound for bound in bounds if bound > -np.inf]


def _ranges(proof: ProofData) -> Iterator[tuple[ProvedStates, Array | None, float]]:
    """Yield the rest states of each range, its largest |Θ|, rad, and the bound of its lowest, J."""
    # Below this bound, all of the range is the region of its lowest state.
    wide = proof.unwrapped
    if proof.on_rotations is not None:
        # There is no largest |Θ| where an energy depends on the rotation alone.
        yield proof, None, _lowest_level(proof)
    elif proof.every_start and proof.within_barriers:
        yield proof, OPEN_RANGE, np.inf
    elif proof.has_energy:
        yield proof, OPEN_RANGE, _lowest_level(proof)
        if wide is not None and proof.every_start:
            yield wide, START_RANGE, np.inf
        elif wide is not None and wide.states and wide.end is not None:
            yield wide, np.array([wide.end[0], OPEN_RANGE[1], wide.end[2]]), _lowest_level(wide)


def _lowest_level(states: ProvedStates) -> float:
    """Return the energy below which all of a range is the region of its lowest state, J."""
    region = states.region
    if region is None or region.energy_bound is None or not region.lower_bound > 0:
        return -np.inf
    return region.energy_bound


START_REGIONS = "start_regions"
"""The name under which the rest states of a proof keep their regions for starts."""


def start_regions(proof: ProofData, states: ProvedStates) -> "StartRegions | None":
    """Return the regions of the minima in one range of a proof; None if there are none.

    Args:
        proof: The proof.
        states: Its rest states in this range.
    """
    stored = proof.reduced_energy
    if stored is None or states.end is None or not states.regions:
        return None
    # It is no field, as `Proof.of` has it.
    kept = vars(states)
    if START_REGIONS not in kept:
        from rbstab.proof.boxes import Box, as_boxes, joined
        from rbstab.proof.regions.starts import RegionLevel, StartRegions
        from rbstab.proof.search import Zeros
        from rbstab.proof.zeros import Zero

        zeros = []
        for state in states.states:
            box, index = Box(*map(np.array, state.enclosure)), state.index
            at = np.array(state.orientation)
            zeros.append(Zero(at, box, box, index if state.index_proved else None, state.energy))
        undecided = [as_boxes(Box(*map(np.array, corners))) for corners in states.undecided]
        listed, end = Zeros(tuple(zeros), joined(undecided, 3), 0), np.array(states.end)
        levels = [
            RegionLevel(region.rest_state - 1, region.energy_bound) for region in states.regions
        ]
        kept[START_REGIONS] = StartRegions(stored.energy, listed, Box(-end, end), levels)
    regions: StartRegions = kept[START_REGIONS]
    return regions


def same_state(proof: ProofData, state: ProvedState) -> int | None:
    """Return the number of a proved rest state among those of a proof in the range of eq. 5.

    Of two boxes that contain exactly one rest state each, one inside the other, both contain the
    same.
    """
    low, high = np.array(state.enclosure)
    for number, other in enumerate(proof.states, start=1):
        least, most = np.array(other.enclosure)
        inner = np.all(least <= low) and np.all(high <= most)
        outer = np.all(low <= least) and np.all(most <= high)
        if other.proved and state.proved and (inner or outer):
            return number
    return None


class EnclosedStart(NamedTuple):
    """Bounds on the energy at a start, J, and on Θ, shape (3,) each, rad."""

    least: float
    energy: float
    low: Array
    high: Array


def start_bounds(problem: Problem) -> EnclosedStart | None:
    """Return bounds on the start of a problem; None if there are none."""
    if problem.exact is None:
        return None
    bounds: EnclosedStart | None = in_balls(partial(enclosed_start, problem.exact))
    return bounds


def enclosed_start(
    exact: Callable[[Callable[[Array], Array]], tuple[System, Array]],
) -> EnclosedStart:
    """Return bounds on the energy at the start, and a box of Θ; call it by `in_balls`."""
    system, start = exact(decimal_balls)
    energies = [
        sum(in_mode.observe(start).energy, ball(0.0)) for in_mode in _in_modes(system, start)
    ]
    Theta = [ball(0.0) + angle for angle in system.motion(start).Theta]
    low, high = [-upper(-angle) for angle in Theta], [upper(angle) for angle in Theta]
    # Unlike those of Python, the extremes of numpy keep what is no number.
    least = np.min([-upper(-energy) for energy in energies])
    most = np.max([upper(energy) for energy in energies])
    return EnclosedStart(float(least), float(most), np.array(low), np.array(high))


def _in_modes(system: System, start: Array) -> list[System]:
    """Return a system in the modes of a start in balls; in both where it is not known in which."""
    if not has_modes(system):
        return [system]
    choices = [
        (1.0,) if g > 0 else (0.0,) if g < 0 else (0.0, 1.0)
        for g in (ball(0.0) + g for g in guards_at(system, start))
    ]
    return [with_modes(system, modes) for modes in product(*choices)]
