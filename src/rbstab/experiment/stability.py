"""Stability of one config, and sentences that describe it."""

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from rbstab.analysis.linearisation import Linearisation, NoDerivativesError, linearise
from rbstab.analysis.rest_system import smooth_rest_system
from rbstab.experiment.answers.rounded import rounded_down
from rbstab.experiment.answers.state_words import (
    almost_sentence,
    capitalized,
    counted_states,
    counterexample,
    every_motion,
    families_of,
    keeps_distance,
    kinds_of,
    other_family,
)
from rbstab.experiment.convergence.convergence import EVERY_START, Convergence
from rbstab.experiment.stored_proof.almost_every_start import almost_every_start
from rbstab.experiment.stored_proof.data import GOES_ON, STOP, UNSPRUNG, ProofData, ProvedStates
from rbstab.experiment.stored_proof.starts import start_level, start_state
from rbstab.files.text import grouped
from rbstab.integrate.problem import Problem
from rbstab.mechanics.algebra import ZERO
from rbstab.mechanics.motion import motion_from_centre
from rbstab.proof.entries import NO_LENGTH, ProvedState

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

    proof: ProofData
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
    problem: Problem, proof: ProofData, convergence: Convergence | None = None
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
            linearisation = None
            if not state.held and abs(np.cos(state.orientation[1])) >= POLE:
                rest = motion_from_centre(system.body, system.anchor, Z)
                with suppress(NoDerivativesError):
                    linearisation = linearise(system, rest, np.array(state.connector_state))
            linearisations.append(linearisation)
        start = start_level(problem, proof)
    reached = start_state(problem, proof)
    return Stability(proof, tuple(linearisations), start, reached, convergence)


def statements_of(proof: ProofData) -> list[str]:
    """Return sentences on a proof by itself, without a start."""
    parts = (*_rest_states(proof), *_regions(proof), *_unwrapped(proof))
    return [f"{sentence}." for sentence in parts]


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


def _rest_states(proof: ProofData) -> Iterator[str]:
    """Yield how many rest states there are, which starts reach them, and how sure that is."""
    almost, count = almost_every_start(proof), len(proof.states)
    if not (count or proof.proved or proof.families):
        yield f"Rest states: not decided ({proof.ended})"
        return
    yield f"Rest states: {_counted(proof)}"
    if almost.proved and not proof.globally_stable:
        yield f"Almost every start: proved. {capitalized(almost_sentence(proof, almost))}"
    yield f"Globally stable: {_global(proof)}"
    if not almost.proved and ((proof.proved and count > 1) or proof.families):
        yield f"Almost every start: not decided ({almost.why})"


def _counted(proof: ProofData) -> str:
    """Return how many rest states there are, and how sure that is."""
    count, boxes = len(proof.states), f"{grouped(proof.examined)} boxes"
    if proof.on_rotations is not None and not proof.examined:
        boxes = "exactly, as eigenvectors"
    kinds = f": {kinds_of(proof.states)}" if count else ""
    if proof.families:
        alone = f"{count or 'no'} isolated rest state{'s' if count > 1 else ''}"
        others = f"and a continuum (a family): {families_of(proof)}"
        return f"{alone} on SO(3){kinds}, {others}; proved to be all ({boxes})"
    if proof.proved:
        every = " to be all" if count else ""
        lengths = " at which each spring has a length" if proof.needs_lengths else ""
        return f"{counted_states(count)} {proof.place}{lengths}{kinds}; proved{every} ({boxes})"
    proved_count = sum(state.proved for state in proof.states)
    some = f"; {proved_count} of them proved" if 0 < proved_count < count else ""
    return f"{counted_states(count)} found{kinds}{some}; not proved to be all: {proof.ended}"


def _global(proof: ProofData) -> str:
    """Return whether every start converges."""
    count, answer = len(proof.states), "not decided"
    other = counterexample(proof) if proof.unique is False else other_family(proof)
    if proof.globally_stable:
        motions = every_motion(proof)
        if proof.every_start:
            keeper = f"{capitalized(str(proof.kept_by))} keeps every motion away from θ2 = ±π/2"
            if proof.within_barriers:
                keeper = "Barriers keep every motion in the range"
            motions = f"{EVERY_START}: proved. {keeper}"
        answer = f"proved. {capitalized(motions)}"
    elif proof.proved and not count and not proof.needs_lengths:
        answer = "false; no motion that stays in the range comes to rest"
    elif proof.unique and proof.globally_stable is False:
        answer = "false; the only rest state in the range is not a minimum"
    elif other is not None:
        not_all = "not every start" if proof.stable_count == 1 else "false"
        answer = f"{not_all}; the body can {'also ' if count else ''}rest at {other}"
    elif count > 1:
        answer = "not decided; false if two of these are rest states"
    return answer


def _regions(proof: ProofData) -> Iterator[str]:
    """Yield the certified region, and the regions of other minima."""
    region = proof.region
    if proof.every_start and proof.states:
        text = "all of the range; c* is infinite"
    elif region is None:
        text = "none"
    else:
        where = f"on {region.face}" if region.face else "at another rest state"
        if region.face == NO_LENGTH:
            where = f"at {NO_LENGTH}"
        attained, goes_on = f"(c* is attained {where})", f"; {GOES_ON}" if proof.goes_on else ""
        if region.lower_bound > 0:
            text = f"{_converging(region.lower_bound)} {attained}"
        elif region.level > 0:
            level = f"less than {region.level:.6g} J above the lowest rest state"
            text = f"{level}, from a search, not proved {attained}{goes_on}"
        elif proof.regions:
            text = (
                "no level above the lowest rest state is enough, as others lie as low. Each has a "
                "region of its own"
            )
        else:
            text = "empty"
    yield f"Certified region: {text}"
    if region is not None and not (proof.every_start and proof.states):
        yield from _of_minima(proof)


def _converging(level: float) -> str:
    """Return that motions below a level converge."""
    start = (
        f"every motion that starts less than {rounded_down(level)} J above the lowest rest state"
    )
    return f"{start} converges to it, proved"


def _of_minima(proof: ProvedStates, what: str = "Region") -> Iterator[str]:
    """Yield a sentence on each region that goes beyond the certified one."""
    certified = 0.0 if proof.region is None else proof.region.lower_bound
    for region in proof.regions:
        where = "not located" if region.pass_face is None else f"on {region.pass_face}"
        if region.pass_state is not None:
            where = f"at rest state {region.pass_state}"
        if region.rest_state > 1 or region.lower_bound > certified * (1 + NOT_DEEPER):
            yield (
                f"{what} of rest state {region.rest_state}: {rounded_down(region.lower_bound)} J "
                f"deep, proved. Every motion in it converges to this rest state; its pass "
                f"is {where}"
            )


def _unwrapped(proof: ProofData) -> Iterator[str]:
    """Yield sentences on all real θ1 and θ3."""
    wide, on_rotations = proof.unwrapped, proof.on_rotations is not None
    searched = not proof.has_energy or proof.outcome == SEARCHED
    if searched or on_rotations or proof.within_barriers:
        return
    if wide is None and (proof.brief or not proof.proved):
        yield f"{UNWRAPPED}: not decided{f' ({GOES_ON})' if proof.goes_on else ''}"
    elif wide is None:
        cause = f"{UNSPRUNG}, so " if proof.unsprung else ""
        why = f"{cause}rest states may have angles too large for a proof"
        yield f"{UNWRAPPED}: not decided; {why}"
    elif not wide.proved:
        yield f"{UNWRAPPED}: not decided ({proof.ended_in(wide)})"
    else:
        kinds, boxes = f": {kinds_of(wide.states)}" if wide.states else "", wide.examined
        sure = f"{counted_states(len(wide.states))}{kinds}; proved ({grouped(boxes)} boxes)"
        every = ""
        if proof.every_start:
            every = f"start {'within the stop' if proof.kept_by == STOP else 'with |θ2| < π/2'}"
        elif wide.globally_stable:
            every = f"motion that {keeps_distance(proof) or 'stays at |θ2| < π/2'}"
        stable = f"; globally stable: every {every} converges" if every else ""
        yield f"{UNWRAPPED}: {sure}{stable}"
        if wide.region is not None and wide.region.lower_bound > 0:
            yield f"{UNWRAPPED}: {_converging(wide.region.lower_bound)}"
        yield from _of_minima(wide, f"{UNWRAPPED}: region")


def _start_sentences(stability: Stability) -> list[str]:
    proof, inside, level = stability.proof, stability.inside, stability.start
    every, convergence = proof.every_start and inside, stability.convergence
    if level is None or not (every or proof.region is not None):
        return []
    start = f"This start: {level:.6g} J above the lowest rest state"
    if every:
        return [f"{start}; convergence is proved, as of every start."]
    if inside:
        to = "" if len(proof.states) == 1 else f" to rest state {stability.reached}"
        return [f"{start}, inside; convergence{to} is proved."]
    if convergence is None:
        return [f"{start}, not inside; nothing is proved for it."]
    its = "Its" if convergence.proved is None else "Its exact motion"
    return [f"{start}, not inside.", f"{its} {convergence.sentence}."]
