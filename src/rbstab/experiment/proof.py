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
from rbstab.config.user_code.permission import may_build, without_code
from rbstab.experiment.answers.reasons import NOT_DAMPED
from rbstab.experiment.answers.rounded import rounded_down
from rbstab.experiment.stored_proof.data import STOPPED, SUPPLIES, TOO_FEW
from rbstab.experiment.stored_proof.identity import proof_id
from rbstab.experiment.stored_proof.proof import Proof, no_proof
from rbstab.experiment.stored_proof.reduced import RangeProof, proof_record, searched_record
from rbstab.experiment.stored_proof.rotations import rotations_record
from rbstab.files.text import grouped
from rbstab.integrate.problem import Problem
from rbstab.systems.system import System

if TYPE_CHECKING:
    from rbstab.proof.model import ExactSystem
    from rbstab.proof.rest_points import RestStates
    from rbstab.proof.rest_states import Body


ENOUGH = 1.0
"""The share of the range that a search would decide with the most boxes of any proof, at its rate
so far: with less, more boxes are not expected to help."""

BRIEF_LIMIT, FULL_LIMIT = 15_000, 100_000
"""The most boxes in each of the four charts of rotations, of a proof for which nobody asked."""

SLOWER = 30
"""So much fewer boxes are searched where positions or own states are left in the energy."""

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
            fewer boxes, such as `limits.BRIEF`, the same number on each machine.

    Returns:
        The rest states and their regions. If nothing can be proved, `Proof.proved` is False and
        `Proof.outcome` is the reason; no error is raised.

    Raises:
        ConfigError: The config is invalid.
    """
    config = load_config(config)
    begin = time.perf_counter()
    with np.errstate(all="ignore"):
        proof = _proof_of(config, problem, search_only=search_only, brief=brief)
    return proof.model_copy(update={"seconds": time.perf_counter() - begin}).of(config)


def _proof_of(config: Config, problem: Problem | None, *, search_only: bool, brief: bool) -> Proof:
    """Return the proof of all configs with what acts on the body of this one."""
    # Imported late: a run usually reads a stored proof and makes none.
    from rbstab.proof.reasons import SEARCHED_INSTEAD, NoReducedEnergy
    from rbstab.proof.rest_states import Body

    identity = proof_id(config)
    if not may_build(config) or system_of(config).supplies:
        return no_proof(identity, SUPPLIES if may_build(config) else CODE_NOT_RUN)
    system = smooth_rest_system(problem or problem_of(config))
    # Code of users is recorded in doubles; it need not accept other numbers.
    exact_system = partial(system_of, without_code(config))
    families = ""
    if not search_only:
        on_rotations = _rotations_proof(identity, system, exact_system, brief=brief)
        if isinstance(on_rotations, Proof):
            return on_rotations
        families = on_rotations
    why_not = no_theorem(config)
    if why_not is not None:
        return _searched(identity, system, f"no proof was tried, as {why_not}")
    try:
        body = Body(system, exact_system)
        proof = _body_proof(identity, body, search_only=search_only, brief=brief)
    except NoReducedEnergy as error:
        if error.reason in SEARCHED_INSTEAD:
            return _searched(identity, system, str(error))
        return no_proof(identity, str(error))
    if families and not proof.proved:
        proof = proof.model_copy(update={"outcome": families})
    return _with_near_model(config, system, proof)


def _rotations_proof(
    identity: str, system: System, exact_system: "ExactSystem", *, brief: bool
) -> Proof | str:
    """Prove the rest states among all rotations of a body that is damped, and reads no angles."""
    from rbstab.proof.rotations.energy import NotOnRotationsError, rotation_energy
    from rbstab.proof.rotations.lists import rest_rotations
    from rbstab.proof.rotations.theorem import (
        why_indefinite,
        why_not_almost_every_start,
        why_not_damped_on_rotations,
    )

    try:
        energy = rotation_energy(system, exact_system)
        exact = exact_system(decimals)
        if why_indefinite(exact) or why_not_damped_on_rotations(exact):
            return ""
        limit = BRIEF_LIMIT if brief else FULL_LIMIT
        rotations = rest_rotations(energy, limit // SLOWER if energy.free else limit)
        if not (rotations.proved or rotations.families):
            # Without a proof: which families the rest states form.
            return rotations.why if rotations.is_family else ""
        why = why_not_almost_every_start(energy, rotations, exact)
        return rotations_record(identity, system, energy, rotations, why)
    except NotOnRotationsError:
        return ""


def _body_proof(identity: str, body: "Body", *, search_only: bool, brief: bool) -> Proof:
    """Prove the rest states of a body, and their regions."""
    from rbstab.proof.limits import search_limit
    from rbstab.proof.regions.regions import NO_REGIONS
    from rbstab.proof.rest_points import SearchOutcome

    def stops(rest: "RestStates | None") -> bool:
        return rest is not None and rest.outcome is SearchOutcome.BOX_LIMIT

    if search_only:
        rest = body.searched()
        return proof_record(identity, body.energy, RangeProof(rest, body.regions(rest)), None)
    limit = search_limit(body.energy, brief=brief)
    rest = body.proved(limit.boxes)
    stopped = stops(rest)
    rate_tells = stopped and rest.examined >= limit.telling
    too_few = rate_tells and rest.covered * limit.most < ENOUGH * rest.examined
    changes = {"outcome": _too_few(rest, limit.most)} if too_few else {}
    left = limit.boxes - rest.examined
    if limit.slow and stopped:
        # Undecided boxes cover most of the range, so no region is left.
        in_range, unwrapped, by_limit = RangeProof(rest, NO_REGIONS), None, True
    else:
        wide = body.wide(rest, left if brief else None)
        # Where every start converges, no region is needed: it is all of the range.
        needed = not (rest.every_start_of_range or (wide is not None and wide.every_start))
        in_range = RangeProof(rest, body.regions(rest) if needed else NO_REGIONS)
        unwrapped = in_range if wide is rest else None
        if wide is not None and wide is not rest:
            # Where the search of the wide range stopped, undecided boxes cover most of it.
            regions = needed and not stops(wide)
            confined = body.regions(wide, confining=True) if regions else NO_REGIONS
            unwrapped = RangeProof(wide, confined)
        by_limit = stopped or (left < body.wide_limit and stops(wide))
    record = proof_record(identity, body.energy, in_range, unwrapped)
    return record.model_copy(update={**changes, "brief": True if brief and by_limit else None})


def _too_few(rest: "RestStates", most: int) -> str:
    """Return how a search ended that needs far more boxes than any proof tries."""
    covered = rounded_down(100 * rest.covered, 3)
    share = f"{grouped(rest.examined)} of them decide {covered} % of the range"
    return f"{TOO_FEW}: {share}; at this rate, the {grouped(most)} of the longest proof are too few"


def _with_near_model(config: Config, system: System, proof: Proof) -> Proof:
    """Return a proof that names the held body, if the boxes were not enough for a tied one."""
    from rbstab.elements.ligament import Ligament

    if (
        proof.outcome.startswith((STOPPED, TOO_FEW))
        and config.controller.variant in TIES_OF_C
        and any(isinstance(element, Ligament) for element in system.elements)
    ):
        return proof.model_copy(update={"outcome": f"{proof.ended}; {HELD_INSTEAD}"})
    return proof


def _searched(identity: str, system: System, why_not: str) -> Proof:
    """Return the rest states that a search finds, and why nothing is proved of them."""
    from rbstab.analysis.descents.kinked import has_kinks
    from rbstab.analysis.descents.searched import searched_minima, searched_rest_states
    from rbstab.elements.guards.soft_guards import SoftGuard
    from rbstab.elements.guards.stop import Stop

    # A root search finds no state where a force that jumps, or a stop, holds the body.
    switching = any(isinstance(element, (SoftGuard, Stop)) for element in system.elements)
    may_hold = switching or has_kinks(system)
    states = (searched_minima if may_hold else searched_rest_states)(system)
    return searched_record(identity, states, why_not)


def no_theorem(config: Config) -> str | None:
    """Return which hypothesis of all theorems does not hold, or None."""
    from rbstab.proof.passive.damping import damping_of_users, why_not_damped
    from rbstab.proof.rotations.theorem import why_indefinite

    exact = system_of(without_code(config), decimals)
    indefinite = why_indefinite(exact)
    if indefinite:
        return indefinite
    undamped = why_not_damped(exact, damping_of_users(system_of(config)))
    return None if undamped is None else f"{NOT_DAMPED}: {undamped}"
