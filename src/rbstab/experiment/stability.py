"""Stability of one config, and sentences that describe it."""

from dataclasses import dataclass

import numpy as np

from rbstab.analysis.linearisation import Linearisation, NoDerivativesError, linearise
from rbstab.analysis.rest_system import smooth_rest_system
from rbstab.experiment.answers.rounded import rounded_down
from rbstab.experiment.convergence.convergence import Convergence
from rbstab.experiment.stored_proof.proof import (
    GOES_ON,
    NO_LENGTH,
    STOP,
    UNSPRUNG,
    Proof,
    ProvedMinimum,
    ProvedState,
    ProvedStates,
)
from rbstab.experiment.stored_proof.starts import start_level, start_state
from rbstab.files.counts import grouped
from rbstab.integrate.problem import Problem
from rbstab.mechanics.algebra import ZERO
from rbstab.mechanics.motion import Motion, motion_from_centre
from rbstab.mechanics.numbers import Array
from rbstab.systems.system import System

UNWRAPPED = "For all real θ1 and θ3"
"""Beginning of the sentences on the range |θ2| < π/2, in which θ1 and θ3 have no bounds."""

SEARCHED = "looked for, not proved"
"""The outcome of a search without a proof (`SearchOutcome.SEARCHED`)."""

NOT_DEEPER = 1e-6
"""A region that is relatively deeper by less than this is not named beside the certified one."""


@dataclass(frozen=True, eq=False)
class Stability:
    """The rest states of a config, its certified region, and its start.

    Args:
        proof: The rest states, lowest first, and the region.
        linearisations: The linearisation at each rest state, in the same order; None where the
            equations have no derivatives.
        start: v(0) relative to the lowest rest state, J; None if no rest state is known.
        reached: The number of the rest state to which the motion from this start converges, proved;
            None: nothing is proved for this start.
        convergence: What is proved of the exact motion from this start; None if that was not asked.
    """

    proof: Proof
    linearisations: tuple[Linearisation | None, ...]
    start: float | None
    reached: int | None
    convergence: Convergence | None = None

    @property
    def inside(self) -> bool:
        """Whether the config starts where convergence to a rest state is proved."""
        return self.reached is not None

    @property
    def statements(self) -> list[str]:
        """Sentences on the rest states, global stability, the certified region and this start."""
        return [
            *_rest_state_sentences(self.proof),
            *_region_sentences(self),
            *_unwrapped_sentences(self.proof),
            *_start_sentences(self),
        ]


def stability_of(
    problem: Problem, proof: Proof, convergence: Convergence | None = None
) -> Stability:
    """Return the stability of a problem, derived from a proof (or a search).

    Args:
        problem: The problem.
        proof: The proof.
        convergence: What is proved of its exact motion, if it was followed.
    """
    system = smooth_rest_system(problem)
    linearisations: list[Linearisation | None] = []
    with np.errstate(all="ignore"):
        for state in proof.states:
            Z = np.concatenate([state.orientation, ZERO, state.position, ZERO])
            if state.held:
                linearisations.append(None)
                continue
            rest = motion_from_centre(system.body, system.anchor, Z)
            linearisations.append(_linearised(system, rest, np.array(state.connector_state)))
        start = start_level(problem, proof)
    reached = start_state(problem, proof)
    return Stability(proof, tuple(linearisations), start, reached, convergence)


def _linearised(system: System, rest: Motion, own: Array) -> Linearisation | None:
    try:
        return linearise(system, rest, own)
    except NoDerivativesError:
        return None


def statements_of(proof: Proof) -> list[str]:
    """Return sentences on a proof by itself, without a start."""
    no_start = Stability(proof, (), 0.0, None)
    return [
        *_rest_state_sentences(proof),
        *_region_sentences(no_start),
        *_unwrapped_sentences(proof),
    ]


def kind_of(state: ProvedState) -> str:
    """Return the kind of a rest state: "stable" (an energy minimum), a saddle, or "maximum".

    Where a guard holds θ2, it is that along θ1 and θ3. It ends with "held" or "on a ridge" where a
    force jumps.
    """
    kind = {0: "stable", 3: "maximum"}.get(state.index, f"saddle, index {state.index}")
    if state.ridge:
        return f"{kind}, on a ridge"
    return f"{kind}, held" if state.held else kind


def _rest_state_sentences(proof: Proof) -> list[str]:
    if not proof.states and not proof.proved:
        return [f"Rest states: not decided ({proof.ended})."]
    count, boxes = len(proof.states), f"{grouped(proof.examined)} boxes"
    number = f"{count or 'no'} rest state{'s' if count > 1 else ''}"
    if proof.proved:
        every = " to be all" if count else ""
        lengths = " at which each spring has a length" if proof.needs_lengths else ""
        where = f"in the range of eq. 5{lengths}"
        sentences = [f"Rest states: {number} {where}, proved{every} ({boxes})."]
    else:
        known = sum(state.proved for state in proof.states)
        some = f", {known} of them proved" if 0 < known < count else ""
        sentences = [f"Rest states: {number} found{some}; not proved to be all: {proof.ended}."]
    if proof.every_start and count:
        sentences.append(
            "Globally stable: proved. Every start in the range converges: proved. "
            f"{_keeper(proof)}."
        )
    elif proof.globally_stable and proof.kept_by:
        springs = ", and keeps each spring from a length of 0," if proof.needs_lengths else ""
        sentences.append(
            f"Globally stable: proved. Every motion that stays in the range{springs} converges to "
            f"the rest state; {proof.kept_by} keeps it away from θ2 = ±π/2."
        )
    elif proof.globally_stable:
        sentences.append(
            f"Globally stable: proved. Every motion that stays in the range, and keeps a distance "
            f"from θ2 = ±π/2{and_lengths(proof)}, converges to the rest state."
        )
    elif proof.proved and not count and not proof.needs_lengths:
        sentences.append("Globally stable: false; no motion that stays in the range comes to rest.")
    elif proof.unique:
        sentences.append("Globally stable: false; the only rest state is not a minimum.")
    elif proof.unique is False and sum(state.proved for state in proof.states) > 1:
        second = [state for state in proof.states if state.proved][1]
        other = ", ".join(f"{angle:.4g}" for angle in second.orientation)
        sentences.append(f"Globally stable: false; the body can also rest at Θ = ({other}) rad.")
    elif count > 1:
        sentences.append("Globally stable: not decided; false if two of these are rest states.")
    else:
        sentences.append("Globally stable: not decided.")
    return sentences


def _keeper(proof: Proof) -> str:
    """Return what keeps motions in the range, as a sentence without its end."""
    if proof.within_barriers:
        return "Barriers keep every motion in the range"
    return f"{str(proof.kept_by).capitalize()} keeps every motion away from θ2 = ±π/2"


def and_lengths(proof: Proof) -> str:
    """Return what else a motion must keep, as the end of a list: lengths of springs, or nothing."""
    return " and each spring from a length of 0" if proof.needs_lengths else ""


def _region_sentences(stability: Stability) -> list[str]:
    region = stability.proof.region
    if stability.proof.every_start and stability.proof.states:
        return ["Certified region: all of the range; c* is infinite."]
    if region is None or stability.start is None:
        return ["Certified region: none."]
    where = f"on {region.face}" if region.face else "at another rest state"
    if region.face == NO_LENGTH:
        where = f"at {NO_LENGTH}"
    goes_on = f"; {GOES_ON}" if stability.proof.brief else ""
    if region.lower_bound > 0:
        sentences = [
            f"Certified region: every motion with v(0) < {rounded_down(region.lower_bound)} J "
            f"converges to the lowest rest state, proved (c* is attained {where})."
        ]
    elif region.level > 0:
        sentences = [
            f"Certified region: v < {region.level:.6g} J, from a search, not proved "
            f"(c* is attained {where}){goes_on}."
        ]
    elif stability.proof.regions:
        sentences = [
            "Certified region: no level of v(0) is enough, as other rest states lie as low as the "
            "lowest. Each has a region of its own."
        ]
    else:
        sentences = ["Certified region: empty."]
    return [*sentences, *_minimum_sentences(stability.proof)]


def _minimum_sentences(proof: ProvedStates, what: str = "Region") -> list[str]:
    """Return a sentence on each region that goes beyond the certified one."""
    certified = 0.0 if proof.region is None else proof.region.lower_bound
    return [
        f"{what} of rest state {one.rest_state}: {rounded_down(one.lower_bound)} J deep, proved. "
        f"Every motion in it converges to this rest state; its pass is {_pass_of(one)}."
        for one in proof.regions
        if one.rest_state > 1 or one.lower_bound > certified * (1 + NOT_DEEPER)
    ]


def _pass_of(region: ProvedMinimum) -> str:
    if region.pass_state is not None:
        return f"at rest state {region.pass_state}"
    return "not located" if region.pass_face is None else f"on {region.pass_face}"


def _unwrapped_sentences(proof: Proof) -> list[str]:
    """Return sentences on all real θ1 and θ3."""
    if not proof.has_energy or proof.outcome == SEARCHED:
        return []
    found = proof.unwrapped
    if proof.within_barriers:
        return []
    if found is None and proof.brief:
        return [f"{UNWRAPPED}: not decided ({GOES_ON})."]
    if found is None:
        cause = f"{UNSPRUNG}, so " if proof.unsprung else ""
        why = f"{cause}rest states may have angles too large for a proof"
        return [f"{UNWRAPPED}: not decided; {why}."]
    if not found.proved:
        return [f"{UNWRAPPED}: not decided ({proof.ended_in(found)})."]
    count = len(found.states)
    first = (
        f"{UNWRAPPED}: {count or 'no'} rest state{'s' if count > 1 else ''}, proved "
        f"({grouped(found.examined)} boxes)"
    )
    if proof.every_start:
        where = "within the stop" if proof.kept_by == STOP else "with |θ2| < π/2"
        first += f"; globally stable: every start {where} converges"
    elif found.globally_stable:
        keeps = f"keeps a distance from θ2 = ±π/2{and_lengths(proof)}"
        if proof.kept_by and proof.needs_lengths:
            keeps = "keeps each spring from a length of 0"
        first += f"; globally stable: every motion that {keeps} converges"
    sentences, region = [f"{first}."], found.region
    if region is not None and region.lower_bound > 0:
        sentences.append(
            f"{UNWRAPPED}: every motion with v(0) < {rounded_down(region.lower_bound)} J converges "
            f"to the lowest rest state, proved."
        )
    return [*sentences, *_minimum_sentences(found, f"{UNWRAPPED}: region")]


def _start_sentences(stability: Stability) -> list[str]:
    start = stability.start
    if stability.proof.every_start and start is not None and stability.inside:
        return [f"This start: v(0) = {start:.6g} J; convergence is proved, as of every start."]
    if stability.proof.region is None or start is None:
        return []
    convergence = stability.convergence
    if not stability.inside and convergence is not None:
        its = "Its" if convergence.proved is None else "Its exact motion"
        outside = f"This start: v(0) = {start:.6g} J is not inside."
        return [outside, f"{its} {convergence.sentence}."]
    if not stability.inside:
        return [f"This start: v(0) = {start:.6g} J is not inside; nothing is proved for it."]
    if len(stability.proof.states) == 1:
        return [f"This start: v(0) = {start:.6g} J is inside; convergence is proved."]
    return [
        f"This start: v(0) = {start:.6g} J is inside; convergence to rest state "
        f"{stability.reached} is proved."
    ]
