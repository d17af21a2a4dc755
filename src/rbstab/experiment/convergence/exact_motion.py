"""The convergence of the exact motion from the start of a config: what is proved of it.

It does not depend on a computed run. The exact motion is enclosed step by step until its energy and
its attitude are in a region from which every motion converges.
"""

import math
import time
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from rbstab.config.schema import Config
from rbstab.experiment.convergence.convergence import (
    ASK_FOR_PROOF,
    Convergence,
    Enclose,
    Undecided,
)
from rbstab.experiment.convergence.decisions import (
    BRIEF_STEPS,
    BY_REGION,
    LEAST_FALL,
    MAX_STEPS,
    NOT_ENCLOSED,
    PATIENCE,
    no_region,
    refusal,
    start_in_region,
)
from rbstab.experiment.convergence.enclosed_samples import EnclosedSamples, quantities_of
from rbstab.experiment.convergence.enclosed_system import (
    enclosed_system,
    exact_start,
    state_scale,
)
from rbstab.experiment.convergence.many_motions import Decisions
from rbstab.experiment.convergence.region_bounds import region_energies
from rbstab.experiment.stored_proof.proof import Proof
from rbstab.integrate.problem import Problem
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import PITCH
from rbstab.proof.motion.equations import Equations
from rbstab.proof.motion.motion import Followed, followed
from rbstab.proof.motion.motion_set import MotionSet
from rbstab.proof.motion.step import SetSteps

OUTSIDE = (
    f"the start is outside of every certified region; {ASK_FOR_PROOF} follows the exact motion"
)


class MotionProof(NamedTuple):
    """A convergence, and the enclosure at the samples of the run as far as it goes.

    samples is None if the motion was not followed.
    """

    convergence: Convergence
    samples: EnclosedSamples | None


STEEP = math.radians(85)
"""rad: an enclosure that ends with a larger |θ2| ends because Euler angles do."""


class _Sample(NamedTuple):
    time: float
    low: Array
    high: Array


def convergence_at_start(config: Config, problem: Problem, proof: Proof | None) -> Convergence:
    """Return what a proof of the rest states says about the start of a config.

    Args:
        config: The config.
        problem: Its problem.
        proof: The proof; None if there is none.
    """
    refused = refusal(problem, proof)
    if refused is not None:
        return _at_start(problem, proof, refused)
    assert proof is not None
    if not proof.has_energy:
        return Convergence(None, why=OUTSIDE, reason=Undecided.OUTSIDE)
    equations = Equations(partial(enclosed_system, config))
    start = exact_start(config, state_scale(problem))
    (found,) = Decisions(proof, equations)(start, np.zeros(1), np.zeros(1, dtype=int))
    if isinstance(found, Convergence):
        return found
    return Convergence(None, why=OUTSIDE, reason=Undecided.OUTSIDE)


def prove_convergence(
    config: Config,
    problem: Problem,
    proof: Proof,
    enclose: Enclose = Enclose.UNTIL_PROVED,
    *,
    max_steps: int | None = None,
) -> MotionProof:
    """Enclose the exact motion of a config until it is where convergence is proved.

    Args:
        config: The config. Its numbers are taken as exact decimals.
        problem: Its problem.
        proof: The proof of its rest states and of their regions.
        enclose: How far to enclose it: until that is proved, or also to the last sample.
        max_steps: The largest number of steps, the same on every machine; default that of a run.
    """
    begin = time.perf_counter()
    brief = enclose is Enclose.BRIEFLY
    max_steps = max_steps or (BRIEF_STEPS if brief else MAX_STEPS)
    refused, to_end = refusal(problem, proof), enclose is Enclose.TO_END
    if refused is not None and (not to_end or refused.reason in NOT_ENCLOSED):
        known = _at_start(problem, proof, refused)
        return MotionProof(replace(known, enclosed=_reached(enclose, known, proof)), None)
    last = float(problem.times[-1]) if to_end else 0.0
    found, samples, steps = _followed(config, problem, last, proof, refused, max_steps)
    seconds = time.perf_counter() - begin
    if brief and found.reason is Undecided.STEP_LIMIT:
        found = replace(found, why=f"{found.why}; {ASK_FOR_PROOF} takes up to {MAX_STEPS} steps")
    enclosed = _reached(enclose, found, proof)
    convergence = replace(found, steps=steps, seconds=seconds, enclosed=enclosed)
    return MotionProof(convergence, _enclosed_samples(config, samples))


def _reached(enclose: Enclose, found: Convergence, proof: Proof) -> Enclose:
    """Return how far a motion was enclosed; a brief enclosure has often found all there is.

    It has not if the proof of the rest states was brief, and a later one may have larger regions.
    """
    may_change = found.reason is Undecided.STEP_LIMIT or (found.proved is None and proof.brief)
    if enclose is Enclose.BRIEFLY and not may_change:
        return Enclose.UNTIL_PROVED
    return enclose


def _followed(  # noqa: PLR0913, PLR0917 (one motion, its limits and its proof)
    config: Config,
    problem: Problem,
    last: float,
    proof: Proof,
    refused: Convergence | None,
    max_steps: int,
) -> tuple[Convergence, list[_Sample], int]:
    """Follow the exact motion until its convergence is decided, and at least to a time.

    Returns:
        The convergence, the enclosed samples, and the number of steps.
    """
    equations, scale = Equations(partial(enclosed_system, config)), state_scale(problem)
    start = exact_start(config, scale)
    decisions, found, reached = Decisions(proof, equations), refused, start
    low, high = (side[:, 0] for side in start.models.range())
    samples = [_Sample(0.0, low, high)]

    def watch(begin: float, step: SetSteps) -> None:
        samples.extend(_samples_in(begin, step, problem.times))

    def decide(
        states: MotionSet, times: Array, numbers: Array
    ) -> list[Convergence | Undecided | None]:
        nonlocal found, reached
        reached = states
        if found is None:
            (now,) = decisions(states, times, numbers)
            if isinstance(now, Undecided):
                return [now]
            found = now
        return [found if times[0] >= last else None]

    (end,) = followed(equations, start, scale, decide, max_steps, watch)
    if end.decision is None or found is None:
        reason, why = _undecided(end, found, reached)
        found = _ended(found, why, reason)
    return found, samples, end.steps


def _undecided(
    end: Followed, found: Convergence | None, reached: MotionSet
) -> tuple[Undecided, str]:
    """Return why an enclosure ended before it was to end."""
    now = f"t = {end.time:.4g} s"
    if end.decision is not None:
        return Undecided.AT_REST, (
            f"v has almost stopped falling, outside of every certified region (by less than "
            f"{LEAST_FALL:g} of its loss in {PATIENCE} steps, to {now})"
        )
    if not end.lost:
        if found is None:
            return (
                Undecided.STEP_LIMIT,
                f"v is too large after {end.steps} steps of the enclosure, at {now}",
            )
        return Undecided.STEP_LIMIT, f"{end.steps} steps of the enclosure reach {now}"
    why = f"the enclosure ends at {now}: no further step could be proved"
    if end.switch:
        why = f"{why}, where the motion grazes or stays at the switch of {end.switch}"
    elif np.abs([side[PITCH, 0] for side in reached.models.range()]).max() > STEEP:
        why = f"{why}, where θ2 is near ±90° and the Euler angles of the enclosure end"
    return Undecided.NO_STEP, why


def _ended(found: Convergence | None, why: str, reason: Undecided) -> Convergence:
    """Return a convergence whose enclosure ended early, with the reason."""
    if found is None:
        return Convergence(None, why=why, reason=reason)
    reasons = [found.why] if found.why else []
    return replace(found, why="; ".join([*reasons, f"not enclosed to the end: {why}"]))


def _at_start(problem: Problem, proof: Proof | None, refused: Convergence) -> Convergence:
    """Return what is known of a motion that is not enclosed, but may start in a region."""
    if refused.reason not in BY_REGION:
        return refused
    inside = start_in_region(problem, proof)
    if inside is None and proof is not None and not region_energies(proof):
        why = no_region(proof)
        if proof.has_energy:
            why = f"{why}. Only a region could decide: {refused.why}"
        return Convergence(None, why=why, reason=Undecided.NO_REGION)
    return inside or refused


def _samples_in(begin: float, step: SetSteps, times: Array) -> Iterator[_Sample]:
    """Yield the enclosures at the samples after the begin of a step, up to its end."""
    for t in times[(times > begin) & (times <= begin + step.h[0])].tolist():
        yield _Sample(t, *step.at(t - begin))


def _enclosed_samples(config: Config, samples: list[_Sample]) -> EnclosedSamples:
    times, low, high = (np.array(column) for column in zip(*samples, strict=True))
    places = quantities_of(enclosed_system(config, lambda values: values)).items()
    return EnclosedSamples(
        times,
        {name: low[:, place] for name, place in places},
        {name: high[:, place] for name, place in places},
    )
