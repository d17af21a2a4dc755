"""Proofs for a body under its gravity and its controller, valid for all its motions."""

import time
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rbstab.analysis.exact import decimals
from rbstab.analysis.rest_system import smooth_rest_system
from rbstab.config.build import problem_of, system_of
from rbstab.config.load import load_config
from rbstab.config.schema import Config
from rbstab.config.user_code.permission import has_code, may_run_code, without_code
from rbstab.experiment.answers.reasons import NOT_DAMPED
from rbstab.experiment.stored_proof.identity import proof_id
from rbstab.experiment.stored_proof.proof import (
    STOPPED,
    SUPPLIES,
    TOO_FEW,
    Proof,
    no_proof,
)
from rbstab.experiment.stored_proof.reduced import Found, proof_record, searched_record
from rbstab.experiment.stored_proof.rotations import rotations_record, state_records
from rbstab.experiment.stored_proof.tied import tied_record
from rbstab.files.counts import grouped
from rbstab.integrate.problem import Problem
from rbstab.systems.system import System

if TYPE_CHECKING:
    from rbstab.analysis.proof.reduced_energy import ExactSystem, NoReducedEnergy
    from rbstab.analysis.proof.rest_states import RestStates


ENOUGH = 0.5
"""The share of the range that a search would decide with the most boxes of any proof, at its rate
so far: with less, more boxes will not help."""

MANY = 8_000
"""The boxes after which this rate is known well enough."""

BRIEF_LIMIT, FULL_LIMIT = 15_000, 100_000
"""The most boxes in each of the four charts of rotations, of a proof for which nobody asked."""

TIES_OF_C = ("visco-elastic", "embedded")

HELD_INSTEAD = "the same body held at C (variant: permanent) may be proved in its place"

CODE_NOT_RUN = "an element is code of a user, which may not run without --allow-python"


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
        brief: Whether the proof may take some five seconds at most. The searches then stop at
            fewer boxes, such as `BRIEF_BOX_LIMIT`, the same number on each machine.

    Returns:
        The rest states and their regions. If nothing can be proved, `Proof.proved` is False and
        `Proof.outcome` is the reason; no error is raised.

    Raises:
        ConfigError: The config is invalid.
    """
    config = load_config(config)
    return _proof_of(config, problem, search_only=search_only, brief=brief).of(config)


def _proof_of(config: Config, problem: Problem | None, *, search_only: bool, brief: bool) -> Proof:
    """Return the proof of all configs with what acts on the body of this one."""
    # Imported late: a run usually reads a stored proof and makes none.
    from rbstab.analysis.proof.reduced_energy import NoEnergyReason, NoReducedEnergy
    from rbstab.analysis.proof.searches.rest_states import searched_rest_states

    start_time = time.perf_counter()
    identity = proof_id(config)
    why_not = _no_search(config)
    if why_not is not None:
        return no_proof(identity, why_not, time.perf_counter() - start_time)
    with np.errstate(all="ignore"):
        system = smooth_rest_system(problem or problem_of(config))
    # Code of users is recorded in doubles; it need not accept other numbers.
    exact_system = partial(system_of, without_code(config))
    options = {"search_only": search_only, "brief": brief}
    families = ""
    if not search_only:
        found = _rotations_proof(identity, system, exact_system, start_time, brief=brief)
        if isinstance(found, Proof):
            return found
        families = found
    why_not = _no_theorem(config)
    try:
        with np.errstate(all="ignore"):
            if why_not is not None:
                why = f"no proof was tried, as {why_not}"
                return _searched(identity, system, why, start_time)
            proof = _reduced_proof(identity, system, exact_system, start_time, **options)
    except NoReducedEnergy as error:
        if error.reason is not NoEnergyReason.SIX_VARIABLES:
            return _no_energy(identity, system, error, start_time)
        if search_only:
            seconds = time.perf_counter() - start_time
            return searched_record(identity, searched_rest_states(system), seconds)
        proof = _tied_proof(identity, system, exact_system, start_time, brief=brief)
    if families and not proof.proved:
        proof = proof.model_copy(update={"outcome": families})
    return _with_near_model(config, system, proof)


def _rotations_proof(
    identity: str,
    system: System,
    exact_system: "ExactSystem",
    start_time: float,
    *,
    brief: bool,
) -> "Proof | str":
    """Prove the rest states among all rotations of a body that is damped, and reads no angles.

    Returns:
        The proof; if there is none, which families rest states form, or "".
    """
    from rbstab.proof.rotations.energy import NotOnRotationsError, rotation_energy
    from rbstab.proof.rotations.lists import rest_rotations
    from rbstab.proof.rotations.theorem import (
        why_indefinite,
        why_not_almost_every_start,
        why_not_damped_on_rotations,
    )

    try:
        with np.errstate(all="ignore"):
            energy = rotation_energy(system, exact_system)
            exact = exact_system(decimals)
            if why_indefinite(exact) or why_not_damped_on_rotations(exact):
                return ""
            found = rest_rotations(energy, BRIEF_LIMIT if brief else FULL_LIMIT)
            if not (found.proved or found.families):
                return found.why if found.is_family else ""
            why = why_not_almost_every_start(energy, found, exact)
            seconds = time.perf_counter() - start_time
            states = state_records(system, energy, found)
            return rotations_record(identity, states, found, why, seconds)
    except NotOnRotationsError:
        return ""


def _reduced_proof(  # noqa: PLR0913 (as `prove`, with what it has computed)
    identity: str,
    system: System,
    exact_system: "ExactSystem",
    start_time: float,
    *,
    search_only: bool,
    brief: bool,
) -> Proof:
    """Prove the rest states of a body by an energy of Θ alone."""
    from rbstab.analysis.proof.outcome import SearchOutcome
    from rbstab.analysis.proof.searches.limits import search_limit
    from rbstab.analysis.proof.unwrapped import box_limit_of
    from rbstab.proof.rest_states import Body

    def seconds() -> float:
        return time.perf_counter() - start_time

    limit, body = search_limit(system, brief=brief), Body(system, exact_system)
    rest = body.searched() if search_only else body.proved(limit.boxes)
    stopped = rest.outcome is SearchOutcome.BOX_LIMIT
    most = search_limit(system, brief=False).boxes
    rate_known = stopped and rest.examined >= MANY
    too_few = rate_known and rest.covered * most < ENOUGH * rest.examined
    changes = {"outcome": _too_few(rest, most)} if too_few else {}
    if limit.slow and stopped:
        # Undecided boxes cover most of the range, so no region is left.
        record = proof_record(identity, _without_regions(rest), None, seconds())
        return record.model_copy(update={**changes, "brief": brief or None})
    left = limit.boxes - rest.examined
    wide = None
    if not search_only:
        wide = body.wide(rest, left if brief else None)
    # Where every start converges, no region is needed: it is all of the range.
    every_start = rest.closed or (wide is not None and wide.every_start)
    regions_of = _without_regions if every_start else _regions_of
    found = regions_of(rest)
    unwrapped = found if wide is rest else None if wide is None else regions_of(wide)
    record = proof_record(identity, found, unwrapped, seconds())
    wide_stopped = wide is not None and wide.outcome is SearchOutcome.BOX_LIMIT
    by_limit = stopped or (left < box_limit_of(rest.energy.form) and wide_stopped)
    return record.model_copy(update={**changes, "brief": True if brief and by_limit else None})


def _too_few(rest: "RestStates", most: int) -> str:
    """Return how a search ended that needs far more boxes than any proof tries."""
    share = f"{grouped(rest.examined)} of them decide {100 * rest.covered:.2g} % of the range"
    return f"{TOO_FEW}: {share}, so the {grouped(most)} that a proof tries at most are too few"


def _with_near_model(config: Config, system: System, proof: Proof) -> Proof:
    """Return a proof that names the held body, if no number of boxes is enough for a tied one."""
    from rbstab.analysis.proof.ligaments.separate import ligaments_apart

    stopped = proof.outcome.startswith((STOPPED, TOO_FEW)) and not proof.goes_on
    if stopped and config.controller.variant in TIES_OF_C and ligaments_apart(system)[1]:
        return proof.model_copy(update={"outcome": f"{proof.ended}; {HELD_INSTEAD}"})
    return proof


def _tied_proof(
    identity: str,
    system: System,
    exact_system: "ExactSystem",
    start_time: float,
    *,
    brief: bool,
) -> Proof:
    """Prove the rest states of a tied body in six variables, such as one with springs."""
    from rbstab.analysis.proof.outcome import SearchOutcome
    from rbstab.analysis.proof.reduced_energy import NoReducedEnergy
    from rbstab.analysis.proof.tied.energy import tied_energy
    from rbstab.analysis.proof.tied.rest_states import tied_rest_states, unwrapped_tied_states
    from rbstab.analysis.proof.tied.search import brief_box_limit

    try:
        energy = tied_energy(system, exact_system)
        total = brief_box_limit(energy) if brief else None
        rest = tied_rest_states(energy, total=total)
        wide, left = None, None if total is None else total - rest.boxes
        # The wider range takes longer still.
        if rest.outcome is not SearchOutcome.BOX_LIMIT:
            wide = unwrapped_tied_states(energy, rest, total=left)
    except NoReducedEnergy as error:
        return _no_energy(identity, system, error, start_time)
    ended_early = brief and (rest.stopped or (wide is not None and wide.stopped))
    record = tied_record(identity, rest, wide, time.perf_counter() - start_time)
    return record.model_copy(update={"brief": True}) if ended_early else record


def _no_energy(identity: str, system: System, error: "NoReducedEnergy", start_time: float) -> Proof:
    """Return the rest states of a body whose energy is in no proof, with the reason."""
    from rbstab.analysis.proof.reduced_energy import SEARCHED_INSTEAD

    if error.reason not in SEARCHED_INSTEAD:
        return no_proof(identity, str(error), time.perf_counter() - start_time)
    return _searched(identity, system, str(error), start_time)


def _searched(identity: str, system: System, why_not: str, start_time: float) -> Proof:
    """Return the rest states that a search finds, and why nothing is proved of them."""
    from rbstab.analysis.descents.kinked import has_kinks
    from rbstab.analysis.proof.guards.separate import has_switching_guards
    from rbstab.analysis.proof.searches.rest_states import searched_minima, searched_rest_states

    # A root search finds no state where a force that jumps, or a stop, holds the body.
    may_hold = has_switching_guards(system) or has_kinks(system)
    states = (searched_minima if may_hold else searched_rest_states)(system)
    return searched_record(identity, states, time.perf_counter() - start_time, outcome=why_not)


def _no_search(config: Config) -> str | None:
    """Return why rest states are not searched for, or None; code of users only builds elements."""
    if has_code(config) and not may_run_code(config):
        return CODE_NOT_RUN
    return SUPPLIES if system_of(config).supplies else None


def _no_theorem(config: Config) -> str | None:
    """Return which hypothesis of all theorems does not hold, or None."""
    from rbstab.proof.passive.damping import damping_of_users, indefinite_parameter, why_not_damped

    system, exact = system_of(config), system_of(without_code(config), decimals)
    indefinite = indefinite_parameter(exact)
    if indefinite is not None:
        return f"{indefinite} is not positive definite"
    undamped = why_not_damped(exact, damping_of_users(system))
    return None if undamped is None else f"{NOT_DAMPED}: {undamped}"


def _without_regions(rest: "RestStates") -> Found:
    return Found(rest, None, ())


def _regions_of(rest: "RestStates") -> Found:
    """Return rest states with the regions of the minima."""
    from rbstab.analysis.proof.boxes import RANGE_END
    from rbstab.analysis.proof.certified_region import certified_region
    from rbstab.analysis.proof.outcome import SearchOutcome
    from rbstab.analysis.proof.regions.minimum_regions import minimum_regions

    if rest.outcome is SearchOutcome.BOX_LIMIT and np.any(rest.end > RANGE_END):
        # Undecided boxes cover most of the range, so no region is left, but it would take long.
        return Found(rest, None, ())
    region = certified_region(rest)
    return Found(rest, region, minimum_regions(rest, region))
