"""Proofs for a body under its gravity and its controller, valid for all its motions."""

import hashlib
import json
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rbstab.analysis.approached_state import SAME_STATE
from rbstab.analysis.exact import ball, decimal_balls, decimals, in_balls, upper
from rbstab.analysis.fingerprint import fingerprint
from rbstab.config.build import problem_of, system_of
from rbstab.config.load import acting_sections, load_config
from rbstab.config.schema import Config
from rbstab.config.user_code.permission import has_code, without_code
from rbstab.experiment.stored_proof.proof import (
    NO_STABILIZERS,
    SUPPLIES,
    Proof,
    ProvedRegion,
    ProvedState,
    ProvedStates,
    no_proof,
)
from rbstab.experiment.stored_proof.reduced import Found, proof_record, searched_record
from rbstab.experiment.stored_proof.tied import tied_record
from rbstab.experiment.switching_record import smooth_rest_system
from rbstab.integrate.problem import Problem
from rbstab.mechanics.numbers import Array
from rbstab.systems.system import System

if TYPE_CHECKING:
    from rbstab.analysis.proof.reduced_energy import ExactSystem
    from rbstab.analysis.proof.rest_states import RestStates

__all__ = [
    "PROOF_VERSION",
    "ROUND_OFF",
    "Proof",
    "ProvedRegion",
    "ProvedState",
    "has_no_rest_state",
    "number_of",
    "proof_id",
    "prove",
    "reached_state",
    "same_state",
    "start_level",
    "start_state",
    "starts_inside",
]

PROOF_VERSION = 3
"""To be increased when a change of the method changes its results; older proofs are then redone.

Version 1 took the doubles of a config as exact, and had no index and no regions that are proved for
each minimum. Ids of versions 1 and 2 have no fingerprint of the equations.
"""

FINGERPRINT_VERSION = 3
"""The first version whose ids have a fingerprint of the equations."""

BARRIER_VERSION = 1
"""The version of the method for configs with a barrier; without one it is in no id."""

ROUND_OFF = 1e-9
"""Relative error allowed for v(0) in doubles: in sweeps, and for proofs of version 1."""

SUM_ERROR = 1e-13
"""Error allowed for v(0), relative to the sum of the absolute energies that it is computed from.

They can be much larger than v(0), if the body starts near its rest state under a load.
"""

OPEN_RANGE = np.array([np.pi, np.pi / 2, np.pi])
"""rad: the largest doubles inside the open range of eq. 5: they are below π and π/2."""

START_RANGE = np.array([np.inf, np.pi / 2, np.inf])
"""rad: the same for all real θ1 and θ3."""


SPRING_VERSION = 1
"""The same for configs with a spring: before it, nothing was proved of them."""

TIED_VERSION = 1
"""The same for those of them whose body is tied."""

TIED_BARRIER_VERSION = 1
"""The same for those of them with a guard: before it, nothing was proved of a barrier there."""

NO_REST_LENGTH_VERSION = 1
"""The same for those of them with a spring without a rest length: before it, more was proved of a
damped one than holds where it has no length."""

HELD_OR_SLIDING = ("permanent", "sliding")
"""Variants whose proofs do not depend on `TIED_VERSION`; with a sliding connector there is none."""


def proof_id(config: Config, version: int = PROOF_VERSION) -> str:
    """Return the identity of a proof: a digest of body, gravity, controller and version.

    From version 3 on it depends on the equations too, by their `fingerprint`: if the equations are
    changed, older proofs are not found. With a barrier, or a spring, it has a further version. The
    code of users is not run for it: their text is part of the elements.
    """
    parts: list[Any] = [version, acting_sections(config)]
    if version >= FINGERPRINT_VERSION:
        parts.append(_equations_of(config))
    if any(element.kind == "guard" for element in config.elements.values()):
        parts.append(f"barrier {BARRIER_VERSION}")
    if any(element.kind == "spring" for element in config.elements.values()):
        parts.append(f"spring {SPRING_VERSION}")
        if config.controller.variant not in HELD_OR_SLIDING:
            parts.append(f"tied {TIED_VERSION}")
            if any(element.kind == "guard" for element in config.elements.values()):
                parts.append(f"tied barrier {TIED_BARRIER_VERSION}")
            if any(getattr(one, "rest_length", None) == 0 for one in config.elements.values()):
                parts.append(f"no rest length {NO_REST_LENGTH_VERSION}")
    text = json.dumps(parts, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()[:32]


_KNOWN_EQUATIONS: dict[str, str] = {}
"""The fingerprints of the last configs, by the text of what acts on their bodies."""

MOST_KNOWN = 1024
"""The largest number of them that is kept."""


def _equations_of(config: Config) -> str:
    """Return the `fingerprint` of a config; it is computed once for all with equal bodies."""
    key = json.dumps([acting_sections(config), config.integration.coordinates], sort_keys=True)
    if key not in _KNOWN_EQUATIONS:
        if len(_KNOWN_EQUATIONS) >= MOST_KNOWN:
            _KNOWN_EQUATIONS.clear()
        _KNOWN_EQUATIONS[key] = fingerprint(partial(system_of, without_code(config)))
    return _KNOWN_EQUATIONS[key]


def prove(
    config: Config | str | Path | Mapping[str, Any],
    problem: Problem | None = None,
    *,
    search_only: bool = False,
    brief: bool = False,
) -> Proof:
    """Find all rest states of a config, and prove from which starts they are reached.

    Rest states are the points of the range |θ2| < π/2, |θ1| and |θ3| < π where the gradient of the
    stored energy is zero. The proofs use interval arithmetic.

    Args:
        config: The config, or any argument that `load_config` takes. The result does not depend on
            its initial state and its integration.
        problem: The initial value problem of the config, if it is built already.
        search_only: Whether to search for the rest states without proving anything.
        brief: Whether the proof may take some five seconds at most. Of a tied body with springs all
            searches then stop at `BRIEF_BOX_LIMIT`; no other proof takes longer.

    Returns:
        The rest states and their regions. If nothing can be proved, `Proof.proved` is False and
        `Proof.outcome` is the reason; no error is raised.

    Raises:
        ConfigError: The config is invalid.
    """
    # Imported late: a run usually reads a stored proof and makes none.
    from rbstab.analysis.proof.lines.searched import searched_rest_states
    from rbstab.analysis.proof.reduced_energy import NoEnergyReason, NoReducedEnergy
    from rbstab.analysis.proof.rest_states import rest_states
    from rbstab.analysis.proof.unwrapped import unwrapped_rest_states

    start_time = time.perf_counter()
    config = load_config(config)
    identity = proof_id(config)
    why_not = _no_search(config)
    if why_not is not None:
        return no_proof(identity, why_not, time.perf_counter() - start_time)
    try:
        with np.errstate(all="ignore"):
            system = smooth_rest_system(problem or problem_of(config))
            exact_system = partial(system_of, config)
            rest = rest_states(system, exact_system, proof=not search_only)
            wide = None if search_only else unwrapped_rest_states(rest)
            # Where every start converges, no region is needed: it is all of the range.
            regions_of = _without_regions if wide is not None and wide.every_start else _regions_of
            found, unwrapped = regions_of(rest), None if wide is None else regions_of(wide)
    except NoReducedEnergy as error:
        if error.reason is not NoEnergyReason.FREE_LINES:
            return no_proof(identity, str(error), time.perf_counter() - start_time)
        if search_only:
            states = searched_rest_states(system)
            return searched_record(identity, states, time.perf_counter() - start_time)
        return _tied_proof(identity, system, exact_system, start_time, brief=brief)
    return proof_record(identity, found, unwrapped, time.perf_counter() - start_time)


def _tied_proof(
    identity: str,
    system: System,
    exact_system: "ExactSystem",
    start_time: float,
    *,
    brief: bool,
) -> Proof:
    """Prove the rest states of a body with springs that is tied: in six variables."""
    from rbstab.analysis.proof.branch_and_bound import SearchOutcome
    from rbstab.analysis.proof.reduced_energy import NoReducedEnergy
    from rbstab.analysis.proof.tied.energy import tied_energy
    from rbstab.analysis.proof.tied.rest_states import tied_rest_states, unwrapped_tied_states
    from rbstab.analysis.proof.tied.search import BRIEF_BOX_LIMIT

    try:
        energy = tied_energy(system, exact_system)
        rest = tied_rest_states(energy, total=BRIEF_BOX_LIMIT if brief else None)
        wide, left = None, BRIEF_BOX_LIMIT - rest.boxes if brief else None
        # The wider range takes longer still.
        if rest.outcome is not SearchOutcome.BOX_LIMIT:
            wide = unwrapped_tied_states(energy, total=left)
    except NoReducedEnergy as error:
        return no_proof(identity, str(error), time.perf_counter() - start_time)
    ended_early = brief and (rest.stopped or (wide is not None and wide.stopped))
    record = tied_record(identity, rest, wide, time.perf_counter() - start_time)
    return record.model_copy(update={"brief": True}) if ended_early else record


def _no_search(config: Config) -> str | None:
    """Return why rest states are not searched for, or None; code of users does not run for it."""
    from rbstab.analysis.proof.definite import damps_every_motion, indefinite_parameter
    from rbstab.analysis.proof.reduced_energy import NoEnergyReason

    if has_code(config):
        return NoEnergyReason.USER_CODE.value
    if system_of(config).supplies:
        return SUPPLIES
    exact = system_of(config, decimals)
    if not damps_every_motion(exact):
        return NO_STABILIZERS
    indefinite = indefinite_parameter(exact)
    return None if indefinite is None else f"{indefinite} is not positive definite"


def _without_regions(rest: "RestStates") -> Found:
    return Found(rest, None, ())


def _regions_of(rest: "RestStates") -> Found:
    """Return rest states with the regions of the minima."""
    from rbstab.analysis.proof.boxes import RANGE_END
    from rbstab.analysis.proof.branch_and_bound import SearchOutcome
    from rbstab.analysis.proof.certified_region import certified_region
    from rbstab.analysis.proof.regions.minimum_regions import minimum_regions

    if rest.outcome is SearchOutcome.BOX_LIMIT and np.any(rest.end > RANGE_END):
        # Undecided boxes cover most of the range, so no region is left, but it would take long.
        return Found(rest, None, ())
    region = certified_region(rest)
    return Found(rest, region, minimum_regions(rest, region))


def has_no_rest_state(proof: Proof) -> bool:
    """Return whether it is proved that there is no rest state with |θ2| < π/2.

    Never of a tied body with springs: it may balance where a spring has no length.
    """
    wide = proof.unwrapped
    return proof.tied_energy is None and wide is not None and wide.proved and not wide.states


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
        if np.abs(Theta - state.orientation).max() < SAME_STATE:
            return number
    return None


def starts_inside(problem: Problem, proof: Proof) -> bool:
    """Return whether a problem starts where convergence to a rest state is proved."""
    return start_state(problem, proof) is not None


def start_state(problem: Problem, proof: Proof) -> int | None:
    """Return the number of the rest state to which the motion of a problem converges, proved.

    The energy and Θ at the start are enclosed for the exact numbers of the config.

    Returns:
        The number, from 1 for the lowest; None if it is not proved.
    """
    if not proof.has_energy or problem.exact is None:
        return 1 if _starts_below(problem, proof) else None
    start = in_balls(partial(enclosed_start, problem.exact))
    return None if start is None else reached_state(proof, *start)


def reached_state(proof: Proof, energy: float, low: Array, high: Array) -> int | None:
    """Return the number of the rest state to which every motion of a set converges, proved.

    The set has all motions that at some time have a total energy of at most `energy`, and Θ in a
    box. As the kinetic energy is not negative, U(Θ) <= energy there.

    Args:
        proof: The proof.
        energy: An upper bound of kinetic plus stored energy, J.
        low: The lower corner of the box of Θ, shape (3,), rad.
        high: The upper corner.

    Returns:
        The number, from 1 for the lowest; None if it is not proved.
    """
    number = _reached(proof, proof, OPEN_RANGE, energy, (low, high))
    wide = proof.unwrapped
    if number is not None or wide is None:
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
    from rbstab.analysis.proof.boxes import Boxes
    from rbstab.analysis.proof.regions.downhill import Landscape
    from rbstab.analysis.proof.trigonometric import MAX_ANGLE

    low, high = box
    inside = np.all(low >= -end) and np.all(low <= high) and np.all(high <= end)
    if not inside or not proof.has_energy:
        return None
    if states.region is not None and _is_below(energy, states.region.energy_bound):
        return 1
    if proof.reduced_energy is None:
        return None
    whole = Boxes(np.array([low], dtype=float), np.array([high], dtype=float))
    form = replace(proof.reduced_energy.form, reach=max(MAX_ANGLE, float(end.max())))
    for region in states.regions:
        if not _is_below(energy, region.energy_bound):
            continue
        corners = states.states[region.rest_state - 1].enclosure
        minimum = Boxes(*(np.array([corner]) for corner in corners))
        landscape = Landscape(form, (minimum,), end)
        with np.errstate(all="ignore"):
            reached = landscape.reached_minimum(whole, region.energy_bound)
        if reached is not None:
            return region.rest_state
    return None


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


def enclosed_start(
    exact: Callable[[Callable[[Array], Array]], tuple[System, Array]],
) -> tuple[float, Array, Array]:
    """Return an upper bound of the energy at the start, and a box of Θ; call it by `in_balls`."""
    system, start = exact(decimal_balls)
    energy = upper(sum(system.observe(start).energy.tolist(), ball(0.0)))
    Theta = [ball(0.0) + angle for angle in system.motion(start).Theta]
    low, high = [-upper(-angle) for angle in Theta], [upper(angle) for angle in Theta]
    return energy, np.array(low), np.array(high)


def _starts_below(problem: Problem, proof: Proof) -> bool:
    """Return whether v(0), computed in doubles, is below the bound of a proof of version 1."""
    level = start_level(problem, proof)
    if level is None or proof.region is None:
        return False
    terms = float(np.abs(_start_energies(problem)).sum()) + abs(proof.states[0].energy)
    error = ROUND_OFF * abs(level) + SUM_ERROR * terms
    return level + error < proof.region.lower_bound


def _start_energies(problem: Problem) -> Array:
    """Return the energy at the start by part, shape (parts,), J."""
    with np.errstate(all="ignore"):
        return problem.system.observe(problem.start).energy
