"""The convergence of the exact motion from the start of a config: what is proved of it.

It does not depend on a computed run. The exact motion is enclosed step by step until its energy and
its attitude are in a region from which every motion converges.
"""

import math
import time
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rbstab.config.schema import Config
from rbstab.experiment.convergence.convergence import (
    ASK_FOR_PROOF,
    Convergence,
    Enclose,
    Undecided,
    undecided,
)
from rbstab.experiment.convergence.decisions import (
    BRIEF_STEPS,
    LEAST_FALL,
    MAX_STEPS,
    PATIENCE,
    convergence_at_start,
    not_enclosed,
    refusal,
)
from rbstab.experiment.convergence.enclosed_samples import EnclosedSamples, quantities_of
from rbstab.experiment.convergence.enclosed_system import enclosed_system, start_set
from rbstab.experiment.convergence.many_motions import Decisions, Motions
from rbstab.experiment.stored_proof.proof import Proof
from rbstab.integrate.problem import Problem
from rbstab.mechanics.states import PITCH
from rbstab.proof.motion.motion import Followed, followed
from rbstab.proof.motion.motion_set import POINT
from rbstab.proof.motion.step import SetSteps

STEEP = math.radians(85)
"""rad: an enclosure that ends with a larger |θ2| ends because Euler angles do."""


class MotionProof(NamedTuple):
    """A convergence, and the enclosure at the samples of the run as far as it goes.

    samples is None if the motion was not followed.
    """

    convergence: Convergence
    samples: EnclosedSamples | None


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
    begin, refused = time.perf_counter(), refusal(problem, proof)
    brief, to_end = enclose is Enclose.BRIEFLY, enclose is Enclose.TO_END
    if refused is not None and (not to_end or not_enclosed(problem) is not None):
        at_start = convergence_at_start(problem, proof)
        return MotionProof(replace(at_start, enclosed=_reached(enclose, at_start, proof)), None)
    motions, last = Motions(config, proof), float(problem.times[-1]) if to_end else 0.0
    decisions = Decisions(proof, motions.equations, last=last)
    if refused is not None:
        decisions.convergences[0] = refused
    start = start_set(config, POINT, motions.scale)
    if start is None:
        too_large = undecided(Undecided.NO_STEP, "the numbers of the start are too large")
        return MotionProof(replace(too_large, enclosed=enclose), None)
    low, high = (side[:, 0] for side in start.models.range())
    samples, angles = [(0.0, low, high)], [low, high]

    def watch(since: float, step: SetSteps) -> None:
        inside = (problem.times > since) & (problem.times <= since + step.h[0])
        samples.extend((t, *step.at(t - since)) for t in problem.times[inside].tolist())
        angles[:] = step.at(step.h[0])

    steps = max_steps or (BRIEF_STEPS if brief else MAX_STEPS)
    (end,) = followed(motions.equations, start, motions.scale, decisions, steps, watch)
    convergence = decisions.convergences.get(0)
    if convergence is None or end.decision is None:
        steep = np.abs([side[PITCH] for side in angles]).max() > STEEP
        failed = _why_ended(end, convergence, steep=bool(steep))
        if brief and failed.reason is Undecided.STEP_LIMIT:
            why = f"{failed.why}; {ASK_FOR_PROOF} takes up to {MAX_STEPS} steps"
            failed = replace(failed, why=why)
        if convergence is not None:
            not_to_end = f"not enclosed to the end: {failed.why}"
            failed = replace(
                convergence, why="; ".join(filter(None, [convergence.why, not_to_end]))
            )
        convergence = failed
    enclosed, seconds = _reached(enclose, convergence, proof), time.perf_counter() - begin
    convergence = replace(convergence, steps=end.steps, seconds=seconds, enclosed=enclosed)
    times, lows, highs = map(np.array, zip(*samples, strict=True))
    places = quantities_of(enclosed_system(config, lambda values: values)).items()
    bounds = ({name: side[:, place] for name, place in places} for side in (lows, highs))
    return MotionProof(convergence, EnclosedSamples(times, *bounds))


def _reached(enclose: Enclose, convergence: Convergence, proof: Proof) -> Enclose:
    """Return how far a motion was enclosed; a brief enclosure has often found all there is."""
    # After a brief proof of the rest states, a later one may have larger regions.
    may_change = convergence.reason is Undecided.STEP_LIMIT or (
        convergence.proved is None and proof.brief
    )
    if enclose is Enclose.BRIEFLY and not may_change:
        return Enclose.UNTIL_PROVED
    return enclose


def _why_ended(end: Followed, convergence: Convergence | None, *, steep: bool) -> Convergence:
    """Return why an enclosure ended before it was to end."""
    now = f"t = {end.time:.4g} s"
    if end.decision is not None:
        why = (
            f"v has almost stopped falling, outside of every certified region (by less than "
            f"{LEAST_FALL:g} of its loss in {PATIENCE} steps, to {now})"
        )
        return undecided(Undecided.AT_REST, why)
    if not end.lost:
        why = f"v is too large after {end.steps} steps of the enclosure, at {now}"
        if convergence is not None:
            why = f"{end.steps} steps of the enclosure reach {now}"
        return undecided(Undecided.STEP_LIMIT, why)
    why = f"the enclosure ends at {now}: no further step could be proved"
    if end.switch:
        why = f"{why}, where the motion grazes or stays at the switch of {end.switch}"
    elif steep:
        why = f"{why}, where θ2 is near ±90° and the Euler angles of the enclosure end"
    return undecided(Undecided.NO_STEP, why)
