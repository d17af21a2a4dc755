"""Stored proofs of convergence for all starts within tolerances, in a folder of results."""

from collections.abc import Callable, Sequence
from pathlib import Path

from rbstab.config.schema import Config
from rbstab.config.tolerances import Tolerance
from rbstab.experiment.proof import prove
from rbstab.experiment.proof_cache import proof_for
from rbstab.experiment.robust.cache import keep, kept
from rbstab.experiment.start_sets.prove_starts import (
    TIME_LIMIT,
    Progress,
    prove_starts,
)
from rbstab.experiment.start_sets.starts_record import StartsProof, starts_id
from rbstab.store.errors import StoreError


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
    identity = starts_id(config, tolerances)
    try:
        stored = kept(folder, StartsProof, identity)
        if stored is not None:
            return stored, None
        rest_states = proof_for(folder, config)
    except StoreError as error:
        problem, rest_states = error, prove(config)
    found = prove_starts(
        config, tolerances, rest_states, processes=processes, progress=progress, is_late=is_late
    )
    if problem is None and found.why != TIME_LIMIT:
        try:
            keep(folder, found)
        except StoreError as error:
            problem = error
    return found, problem
