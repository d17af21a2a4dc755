"""Prove that the motions from all starts within tolerances converge; store the proof."""

import time
from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import partial
from math import inf, nextafter, prod
from pathlib import Path

import numpy as np

from rbstab.config.build import problem_of
from rbstab.config.schema import Config
from rbstab.config.tolerances import Tolerance
from rbstab.experiment.convergence.decisions import refusal
from rbstab.experiment.convergence.many_motions import Motions
from rbstab.experiment.proof import prove
from rbstab.experiment.proof_cache import proof_for
from rbstab.experiment.robust.record import bounds_of
from rbstab.experiment.start_sets.start_set import start_set_of, whole
from rbstab.experiment.start_sets.starts_record import (
    MAX_PARTS,
    VERSION,
    ProvedPart,
    StartsProof,
    starts_id,
)
from rbstab.experiment.stored_proof.proof import Proof
from rbstab.processes.workers import worked
from rbstab.proof.boxes import Box, as_boxes
from rbstab.proof.motion.motion import MAX_STEPS, Followed
from rbstab.store.errors import StoreError

TIME_LIMIT = "the time limit was reached"
"""Why a proof is not complete that is not stored: with more time, it may be."""

NARROWEST = 2.0**-40
"""A part with this width in z is not halved, so that the ends of all parts are exact doubles."""

Progress = Callable[[float, int], None]
"""Called with the fraction of the starts that is proved, and the number of parts to be followed."""


def prove_starts(  # noqa: PLR0913 (options by name)
    config: Config,
    tolerances: Sequence[Tolerance],
    proof: Proof,
    *,
    processes: int = 1,
    progress: Progress | None = None,
    is_late: Callable[[], bool] = lambda: False,
) -> StartsProof:
    """Prove that the motions from all starts within tolerances converge.

    All starts are followed together. Where that fails, they are halved, and both halves are
    followed from the start. The result does not depend on the number of processes.

    Args:
        config: The config.
        tolerances: Tolerances of its initial state, and of nothing else.
        proof: The proof of its rest states and of their regions.
        processes: The largest number of worker processes.
        progress: Called after each part that is decided.
        is_late: Returns whether no further part is to be followed.
    """
    begin, problem = time.perf_counter(), problem_of(config)
    refused = refusal(problem, proof)
    parts: list[ProvedPart] = []
    examined, steps, given_up, waiting = 0, 0, 0, list[Box]()
    why = "" if refused is None else refused.why
    if refused is None:
        waiting = [whole(len(tolerances))]
    while waiting and len(parts) + len(waiting) + given_up <= MAX_PARTS and not is_late():
        halves: list[Box] = []
        followed = worked(
            _follow,
            waiting,
            lambda part: part,
            workers=min(processes, len(waiting)),
            may_begin=lambda: not is_late(),
            is_given_up=is_late,
            setup=partial(_set_up, config, tolerances, proof),
        )
        for part, result in followed:
            examined, steps, axis = examined + 1, steps + result.steps, result.variable
            if result.decision is not None:
                parts.append(_proved_part(part, result))
            elif axis is not None and part.hi[axis] - part.lo[axis] > NARROWEST:
                both = as_boxes(part).halved(np.array([axis]))
                halves += map(Box, both.lo.T, both.hi.T)
            else:
                given_up += 1
                why = f"a part that is narrower than {NARROWEST:.1g} of the tolerances is left"
                if result.lost and axis is None:
                    why = "the tolerances are too wide, or the numbers of the start too large"
                elif axis is None:
                    why = f"v is too large after {MAX_STEPS} steps, at t = {result.time:.4g} s"
            if progress is not None:
                progress(_fraction(parts), len(waiting) + len(halves))
        waiting = halves
    fraction = _fraction(parts)
    if is_late() and fraction < 1.0:
        why = TIME_LIMIT
    elif waiting:
        why = f"more than {MAX_PARTS} parts would be needed"
    return StartsProof(
        id=starts_id(config, tolerances),
        version=VERSION,
        tolerances=bounds_of(tolerances),
        parts=tuple(parts),
        fraction=fraction,
        examined=examined,
        steps=steps,
        why=why,
        seconds=time.perf_counter() - begin,
    )


def _proved_part(part: Box, result: Followed) -> ProvedPart:
    convergence = result.decision
    return ProvedPart(
        low=part.lo,
        high=part.hi,
        rest_state=convergence.rest_state,
        time=result.time,
        energy=convergence.energy,
        bound=None if convergence.bound == inf else convergence.bound,
        steps=result.steps,
    )


def _fraction(parts: list[ProvedPart]) -> float:
    """Return the volume of parts in that of the whole, rounded down: 1 if nothing is left."""
    volume = Fraction(0)
    for part in parts:
        sides = zip(part.low, part.high, strict=True)
        volume += prod((Fraction(high) - Fraction(low)) / 2 for low, high in sides)
    rounded = float(volume)
    return rounded if Fraction(rounded) <= volume else nextafter(rounded, 0.0)


_shared: list[tuple[Config, Sequence[Tolerance], Motions]] = []
"""What the parts in a process share; set by `_set_up`."""


def _set_up(config: Config, tolerances: Sequence[Tolerance], proof: Proof) -> None:
    _shared[:] = [(config, tolerances, Motions(config, proof))]


def _follow(part: Box) -> Followed:
    """Follow one part; a wide one may seem to rest, and is followed further."""
    config, tolerances, motions = _shared[0]
    starts = start_set_of(config, tolerances, part, motions.scale)
    if starts is None:  # they have no bounds
        return Followed(0, 0.0, lost=True)
    (motion,) = motions.follow(starts, rests=False)
    return motion


def starts_for(  # noqa: PLR0913 (options by name)
    folder: Path,
    config: Config,
    tolerances: Sequence[Tolerance],
    *,
    processes: int = 1,
    progress: Progress | None = None,
    is_late: Callable[[], bool] = lambda: False,
) -> tuple[StartsProof, StoreError | None]:
    """Return the stored proof of all starts; if there is none, make it and store it.

    Args:
        folder: The folder of results.
        config: The config.
        tolerances: Tolerances of its initial state.
        processes: The largest number of worker processes.
        progress: Called after each part that is decided.
        is_late: As for `prove_starts`. A proof that ended early is not stored.

    Returns:
        The proof, and the error if it could not be read or stored.
    """
    problem: StoreError | None = None
    try:
        stored = StartsProof.kept(folder, starts_id(config, tolerances))
        if stored is not None:
            return stored, None
        rest_states = proof_for(folder, config)
    except StoreError as error:
        problem, rest_states = error, prove(config)
    proof = prove_starts(
        config, tolerances, rest_states, processes=processes, progress=progress, is_late=is_late
    )
    if problem is None and proof.why != TIME_LIMIT:
        try:
            proof.keep(folder)
        except StoreError as error:
            problem = error
    return proof, problem
