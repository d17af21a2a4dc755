"""Stability of one config, and sentences that describe it."""

from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from rbstab.analysis.linearisation import Linearisation, NoDerivativesError, linearise
from rbstab.analysis.rest_system import smooth_rest_system
from rbstab.experiment.answers.rounded import rounded_down
from rbstab.experiment.answers.state_words import (
    almost_sentence,
    counted_states,
    counterexample,
    families_of,
    kinds_of,
    other_family,
)
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
from rbstab.mechanics.motion import motion_from_centre

UNWRAPPED = "For all real θ1 and θ3"
"""Beginning of the sentences on the range |θ2| < π/2, in which θ1 and θ3 have no bounds."""

SEARCHED = "looked for, not proved"
"""The outcome of a search without a proof (`SearchOutcome.SEARCHED`)."""

POLE = 1e-6
"""|cos θ2| below which equations in Euler angles have no derivatives."""

NOT_DEEPER = 1e-6
"""A region that is relatively deeper by less than this is not named beside the certified one."""


@dataclass(frozen=True, eq=False)
class Stability:
    """The rest states of a config, its certified region, and its start.

    Args:
        proof: The rest states, lowest first, and the region.
        linearisations: The linearisation at each rest state, in the same order; None where the
            equations have no derivatives.
        start: The energy of the start above the lowest rest state, J; None if none is known.
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
        return [*statements_of(self.proof), *_start_sentences(self)]


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
            found = None
            if not state.held and abs(np.cos(state.orientation[1])) >= POLE:
                rest = motion_from_centre(system.body, system.anchor, Z)
                with suppress(NoDerivativesError):
                    found = linearise(system, rest, np.array(state.connector_state))
            linearisations.append(found)
        start = start_level(problem, proof)
    reached = start_state(problem, proof)
    return Stability(proof, tuple(linearisations), start, reached, convergence)


def statements_of(proof: Proof) -> list[str]:
    """Return sentences on a proof by itself, without a start."""
    return [
        *_rest_state_sentences(proof),
        *_region_sentences(proof),
        *_unwrapped_sentences(proof),
    ]


def kind_of(state: ProvedState) -> str:
    """Return the kind of a rest state: "stable" (an energy minimum), or "unstable" with its index.

    Where a guard holds θ2, it is that along θ1 and θ3. It ends with "held" or "on a ridge" where a
    force jumps.
    """
    if state.degenerate:
        return "not determined: degenerate"
    kind = "stable" if state.stable else f"unstable, index {state.index}"
    if state.ridge:
        return f"{kind}, on a ridge"
    return f"{kind}, held" if state.held else kind


def _rest_state_sentences(proof: Proof) -> list[str]:
    if not (proof.states or proof.proved or proof.families):
        return [f"Rest states: not decided ({proof.ended})."]
    almost, count = proof.almost_every_start, len(proof.states)
    sentences = [_counts_sentence(proof), _global_sentence(proof)]
    if almost.proved and not proof.globally_stable:
        sentence = almost_sentence(proof, almost)
        sentences.insert(1, f"Almost every start: proved. {sentence[:1].upper()}{sentence[1:]}.")
    elif (proof.proved and count > 1) or proof.families:
        sentences.append(f"Almost every start: not decided ({almost.why}).")
    return sentences


def _counts_sentence(proof: Proof) -> str:
    """Return a sentence on how many rest states there are, and how sure that is."""
    count, boxes = len(proof.states), f"{grouped(proof.examined)} boxes"
    if proof.on_rotations is not None and not proof.examined:
        boxes = "exactly, as eigenvectors"
    kinds = f": {kinds_of(proof.states)}" if count else ""
    if proof.families:
        alone = f"{count or 'no'} isolated rest state{'s' if count > 1 else ''}"
        others = f"and a continuum (a family): {families_of(proof)}"
        return f"Rest states: {alone} on SO(3){kinds}, {others}; proved to be all ({boxes})."
    if proof.proved:
        every = " to be all" if count else ""
        lengths = " at which each spring has a length" if proof.needs_lengths else ""
        where = f"{proof.place}{lengths}{kinds}"
        return f"Rest states: {counted_states(count)} {where}; proved{every} ({boxes})."
    known = sum(state.proved for state in proof.states)
    some = f"; {known} of them proved" if 0 < known < count else ""
    found = f"{counted_states(count)} found{kinds}{some}"
    return f"Rest states: {found}; not proved to be all: {proof.ended}."


def _global_sentence(proof: Proof) -> str:
    """Return a sentence on whether every start converges."""
    if proof.globally_stable:
        return f"Globally stable: proved. {_all_motions(proof)}."
    count = len(proof.states)
    if proof.proved and not count and not proof.needs_lengths:
        return "Globally stable: false; no motion that stays in the range comes to rest."
    if proof.unique and proof.globally_stable is False:
        return "Globally stable: false; the only rest state in the range is not a minimum."
    other = counterexample(proof) if proof.unique is False else other_family(proof)
    if other is not None:
        not_all = "not every start" if proof.stable_count == 1 else "false"
        also = "also " if count else ""
        return f"Globally stable: {not_all}; the body can {also}rest at {other}."
    if count > 1:
        return "Globally stable: not decided; false if two of these are rest states."
    return "Globally stable: not decided."


def _all_motions(proof: Proof) -> str:
    """Return of which motions it is proved that they converge to the only rest state."""
    if proof.every_start:
        return f"Every start in the range converges: proved. {_keeper(proof)}"
    keeps, kept = f", and keeps a distance from θ2 = ±π/2{and_lengths(proof)},", ""
    if proof.kept_by:
        keeps = ", and keeps each spring from a length of 0," if proof.needs_lengths else ""
        kept = f"; {proof.kept_by} keeps it away from θ2 = ±π/2"
    return f"Every motion that stays in the range{keeps} converges to the rest state{kept}"


def _keeper(proof: Proof) -> str:
    """Return what keeps motions in the range, as a sentence without its end."""
    if proof.within_barriers:
        return "Barriers keep every motion in the range"
    return f"{str(proof.kept_by).capitalize()} keeps every motion away from θ2 = ±π/2"


def and_lengths(proof: Proof) -> str:
    """Return what else a motion must keep, as the end of a list: lengths of springs, or nothing."""
    return " and each spring from a length of 0" if proof.needs_lengths else ""


def _region_sentences(proof: Proof) -> list[str]:
    region = proof.region
    if proof.every_start and proof.states:
        return ["Certified region: all of the range; c* is infinite."]
    if region is None:
        return ["Certified region: none."]
    where = f"on {region.face}" if region.face else "at another rest state"
    if region.face == NO_LENGTH:
        where = f"at {NO_LENGTH}"
    goes_on = f"; {GOES_ON}" if proof.goes_on else ""
    if region.lower_bound > 0:
        sentences = [
            f"Certified region: every motion that starts less than "
            f"{rounded_down(region.lower_bound)} J above the lowest rest state converges to it, "
            f"proved (c* is attained {where})."
        ]
    elif region.level > 0:
        sentences = [
            f"Certified region: less than {region.level:.6g} J above the lowest rest state, from a "
            f"search, not proved (c* is attained {where}){goes_on}."
        ]
    elif proof.regions:
        sentences = [
            "Certified region: no level above the lowest rest state is enough, as others lie as "
            "low. Each has a region of its own."
        ]
    else:
        sentences = ["Certified region: empty."]
    return [*sentences, *_minimum_sentences(proof)]


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
    if not proof.has_energy or proof.outcome == SEARCHED or proof.on_rotations is not None:
        return []
    found = proof.unwrapped
    if proof.within_barriers:
        return []
    if found is None and (proof.brief or not proof.proved):
        return [f"{UNWRAPPED}: not decided{f' ({GOES_ON})' if proof.goes_on else ''}."]
    if found is None:
        cause = f"{UNSPRUNG}, so " if proof.unsprung else ""
        why = f"{cause}rest states may have angles too large for a proof"
        return [f"{UNWRAPPED}: not decided; {why}."]
    if not found.proved:
        return [f"{UNWRAPPED}: not decided ({proof.ended_in(found)})."]
    kinds = f": {kinds_of(found.states)}" if found.states else ""
    first = (
        f"{UNWRAPPED}: {counted_states(len(found.states))}{kinds}; proved "
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
            f"{UNWRAPPED}: every motion that starts less than {rounded_down(region.lower_bound)} J "
            f"above the lowest rest state converges to it, proved."
        )
    return [*sentences, *_minimum_sentences(found, f"{UNWRAPPED}: region")]


def _start_sentences(stability: Stability) -> list[str]:
    every = stability.proof.every_start and stability.inside
    if stability.start is None or not (every or stability.proof.region is not None):
        return []
    start = f"This start: {stability.start:.6g} J above the lowest rest state"
    if every:
        return [f"{start}; convergence is proved, as of every start."]
    convergence = stability.convergence
    if not stability.inside and convergence is not None:
        its = "Its" if convergence.proved is None else "Its exact motion"
        return [f"{start}, not inside.", f"{its} {convergence.sentence}."]
    if not stability.inside:
        return [f"{start}, not inside; nothing is proved for it."]
    if len(stability.proof.states) == 1:
        return [f"{start}, inside; convergence is proved."]
    return [f"{start}, inside; convergence to rest state {stability.reached} is proved."]
