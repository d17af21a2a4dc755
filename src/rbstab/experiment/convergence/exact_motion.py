"""The convergence of the exact motion from the start of a config: what is proved of it.

It does not depend on a computed run. The exact motion is enclosed step by step until its energy and
its attitude are in a region from which every motion converges.
"""

import time
from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from rbstab.analysis.motion_proof.dual import decimal_duals
from rbstab.analysis.motion_proof.expansion import NARROW, Accuracy
from rbstab.analysis.motion_proof.motion import (
    MotionStep,
    Unproved,
    angle_bounds,
    enclosed_motion,
    energy_bounds,
    proof_precision,
    start_set,
)
from rbstab.analysis.motion_proof.rounding import magnitude_of
from rbstab.analysis.motion_proof.step import StateSet
from rbstab.config.build import start_of
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
    NO_REGION,
    NOT_ENCLOSED,
    PATIENCE,
    convergence_in,
    refusal,
    start_in_region,
)
from rbstab.experiment.convergence.enclosed_samples import EnclosedSamples, quantities_of
from rbstab.experiment.convergence.enclosed_system import enclosed_system, state_scale
from rbstab.experiment.convergence.region_bounds import region_energies
from rbstab.experiment.stored_proof.proof import Proof
from rbstab.experiment.stored_proof.starts import ROUND_OFF, start_level, starts_inside
from rbstab.integrate.problem import Problem
from rbstab.mechanics.numbers import Array
from rbstab.systems.system import System


class Limits(NamedTuple):
    """How far a motion may be enclosed, and how accurately: the same on every machine."""

    steps: int
    accuracy: Accuracy = NARROW


OUTSIDE = (
    f"the start is outside of every certified region; {ASK_FOR_PROOF} follows the exact motion"
)


class MotionProof(NamedTuple):
    """A convergence, and the enclosure at the samples of the run as far as it goes.

    samples is None if the motion was not followed.
    """

    convergence: Convergence
    samples: EnclosedSamples | None


class _Start(NamedTuple):
    """The system of balls, the set of its initial state, and a scale of its states."""

    system: System
    states: StateSet
    scale: Array


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
        return _by_older_proof(problem, proof)
    with proof_precision():
        start = _exact_start(config, problem)
        energy = energy_bounds(start.system, start.states)
        inside = _convergence(proof, energy, start.states, 0.0)
    return inside or Convergence(None, why=OUTSIDE, reason=Undecided.OUTSIDE)


def prove_convergence(
    config: Config,
    problem: Problem,
    proof: Proof,
    enclose: Enclose = Enclose.UNTIL_PROVED,
    *,
    limits: Limits | None = None,
) -> MotionProof:
    """Enclose the exact motion of a config until it is where convergence is proved.

    Args:
        config: The config. Its numbers are taken as exact decimals.
        problem: Its problem.
        proof: The proof of its rest states and of their regions.
        enclose: How far to enclose it: until that is proved, or also to the last sample.
        limits: The largest number of steps, and how accurate they are; default those of a run.
    """
    begin = time.perf_counter()
    brief = enclose is Enclose.BRIEFLY
    limits = limits or Limits(BRIEF_STEPS if brief else MAX_STEPS)
    refused, to_end = refusal(problem, proof), enclose is Enclose.TO_END
    if refused is not None and (not to_end or refused.reason in NOT_ENCLOSED):
        known = _at_start(problem, proof, refused)
        return MotionProof(replace(known, enclosed=_reached(enclose, known, proof)), None)
    with proof_precision():
        start = _exact_start(config, problem)
        last = float(problem.times[-1]) if to_end else 0.0
        found, samples, steps = _followed(start, problem.times, last, proof, refused, limits)
    seconds = time.perf_counter() - begin
    if brief and found.reason is Undecided.STEP_LIMIT:
        found = replace(found, why=f"{found.why}; {ASK_FOR_PROOF} takes up to {MAX_STEPS} steps")
    enclosed = _reached(enclose, found, proof)
    convergence = replace(found, steps=steps, seconds=seconds, enclosed=enclosed)
    return MotionProof(convergence, _enclosed_samples(start.system, samples))


def _reached(enclose: Enclose, found: Convergence, proof: Proof) -> Enclose:
    """Return how far a motion was enclosed; a brief enclosure has often found all there is.

    It has not if the proof of the rest states was brief, and a later one may have larger regions.
    """
    may_change = found.reason is Undecided.STEP_LIMIT or (found.proved is None and proof.brief)
    if enclose is Enclose.BRIEFLY and not may_change:
        return Enclose.UNTIL_PROVED
    return enclose


def _followed(  # noqa: PLR0913, PLR0917 (one motion, its limits and its proof)
    start: _Start,
    times: Array,
    last: float,
    proof: Proof,
    refused: Convergence | None,
    limits: Limits,
) -> tuple[Convergence, list[_Sample], int]:
    """Follow the exact motion until its convergence is decided, and at least to a time.

    Returns:
        The convergence, the enclosed samples, and the number of steps.
    """
    system = start.system
    energy = energy_bounds(system, start.states)
    found = refused or _convergence(proof, energy, start.states, 0.0)
    samples = [_sample(start.states.centre, start.states.spread, 0.0)]
    now, steps = 0.0, 0
    energies = [energy[0]]
    motion = enclosed_motion(system, start.states, start.scale, limits.accuracy)
    while found is None or now < last:
        if steps == limits.steps or (found is None and _is_at_rest(energies)):
            why = f"v is too large after {steps} steps of the enclosure, at t = {now:.4g} s"
            if found is not None:
                why = f"{steps} steps of the enclosure reach t = {now:.4g} s"
            elif steps < limits.steps:
                why = (
                    f"v has almost stopped falling, outside of every certified region (by less "
                    f"than {LEAST_FALL:g} of its loss in {PATIENCE} steps, to t = {now:.4g} s)"
                )
            reason = Undecided.STEP_LIMIT if steps == limits.steps else Undecided.AT_REST
            return _ended(found, why, reason), samples, steps
        try:
            step = next(motion)
        except Unproved:
            why = f"the enclosure ends at t = {now:.4g} s: no further step could be proved"
            return _ended(found, why, Undecided.NO_STEP), samples, steps
        steps, now = steps + 1, step.end_time
        samples += _samples_in(step, times)
        energy = energy_bounds(system, step.step.end)
        energies.append(energy[0])
        found = found or _convergence(proof, energy, step.step.end, now)
    return found, samples, steps


def _ended(found: Convergence | None, why: str, reason: Undecided) -> Convergence:
    """Return a convergence whose enclosure ended early, with the reason."""
    if found is None:
        return Convergence(None, why=why, reason=reason)
    reasons = [found.why] if found.why else []
    return replace(found, why="; ".join([*reasons, f"not enclosed to the end: {why}"]))


def _is_at_rest(energies: list[float]) -> bool:
    """Return whether the energy, J, after each step has stopped falling."""
    if len(energies) <= PATIENCE:
        return False
    return energies[-PATIENCE - 1] - energies[-1] < LEAST_FALL * (energies[0] - energies[-1])


def _at_start(problem: Problem, proof: Proof | None, refused: Convergence) -> Convergence:
    """Return what is known of a motion that is not enclosed, but may start in a region."""
    if refused.reason not in BY_REGION:
        return refused
    inside = start_in_region(problem, proof)
    if inside is None and proof is not None and not region_energies(proof):
        why = NO_REGION if proof.proved else f"{NO_REGION} ({proof.ended})"
        if proof.has_energy:
            why = f"{why}. Only a region could decide: {refused.why}"
        return Convergence(None, why=why, reason=Undecided.NO_REGION)
    return inside or refused


def _by_older_proof(problem: Problem, proof: Proof) -> Convergence:
    """Return what a proof of version 1 says about a start: v(0) in doubles, with its margin."""
    level = start_level(problem, proof)
    if proof.region is None or level is None or not starts_inside(problem, proof):
        return Convergence(None, why=OUTSIDE, reason=Undecided.OUTSIDE)
    margin = ROUND_OFF * abs(level)
    energy = (level - margin, level + margin)
    bound = proof.region.lower_bound
    return Convergence(True, rest_state=1, time=0.0, energy=energy, bound=bound)


def _exact_start(config: Config, problem: Problem) -> _Start:
    system, scale = enclosed_system(config, decimal_duals), state_scale(problem)
    return _Start(system, start_set(start_of(config, system, decimal_duals), scale), scale)


def _convergence(
    proof: Proof, energy: tuple[float, float], states: StateSet, t: float
) -> Convergence | None:
    """Return the convergence of all states of a set if it is proved, else None.

    Args:
        proof: The proof of the rest states.
        energy: Bounds on the total energy of the states, J.
        states: The set.
        t: The time, s.
    """
    return convergence_in(proof, energy, angle_bounds(states), t)


def _samples_in(step: MotionStep, times: Array) -> Iterator[_Sample]:
    """Yield the enclosures at the samples after the begin of a step, up to its end."""
    for t in times[(times > step.time) & (times <= step.end_time)].tolist():
        yield _sample(*step.state_at(t), t)


def _sample(centre: list[Any], distance: Array, t: float) -> _Sample:
    middle = np.array([float(entry) for entry in centre])
    apart = [
        magnitude_of(exact - double) for exact, double in zip(centre, middle.tolist(), strict=True)
    ]
    reach = np.nextafter(distance + np.array(apart), np.inf)
    return _Sample(t, np.nextafter(middle - reach, -np.inf), np.nextafter(middle + reach, np.inf))


def _enclosed_samples(system: System, samples: list[_Sample]) -> EnclosedSamples:
    times, low, high = (np.array(column) for column in zip(*samples, strict=True))
    places = quantities_of(system).items()
    return EnclosedSamples(
        times,
        {name: low[:, place] for name, place in places},
        {name: high[:, place] for name, place in places},
    )
