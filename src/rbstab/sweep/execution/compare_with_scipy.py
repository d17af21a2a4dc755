"""Rerun sampled members with SciPy, compare them with the stored ones, and keep the comparison."""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict
from itertools import groupby
from operator import lt
from threading import Event
from typing import Annotated

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, NonNegativeInt

from rbstab.mechanics.numbers import Array
from rbstab.processes.workers import Worker
from rbstab.store.document import read_model, write_document
from rbstab.store.errors import NotAResultError, StoreError
from rbstab.sweep.execution.comparison_runs import MEMBERS_PER_WORKER, ComparisonRuns
from rbstab.sweep.folder.sweep_folder import SweepFolder
from rbstab.sweep.members.compared_members import members_to_compare
from rbstab.sweep.members.scipy_comparison import ENGINE, ScipyComparison, compare
from rbstab.sweep.plan.plan import Plan

MIN_FOR_WORKERS = 512
"""Fewest members of a plan for which starting a worker process saves time."""

_Difference = Annotated[float, Field(ge=0, allow_inf_nan=False)]


class _StoredComparison(BaseModel):
    """A `ScipyComparison`, as it is stored."""

    model_config = ConfigDict(extra="forbid")

    shards_digest: str
    members: tuple[int, ...]
    unlike: NonNegativeInt
    differences: dict[str, _Difference]


def comparison_runs(  # noqa: PLR0913 (all that decides where the members are run)
    plan: Plan,
    folder: SweepFolder,
    count: int | None,
    *,
    complete: bool,
    processes: int,
    started: Worker | None = None,
) -> ComparisonRuns:
    """Return the single runs for a comparison; of a long plan they start now, beside the sweep.

    A complete folder keeps the members of its comparison, unless a number is given.

    Args:
        plan: The plan.
        folder: The folder of the sweep.
        count: The number of members to compare; default see `members_to_compare`.
        complete: Whether the folder has all its shards.
        processes: The largest number of processes, with this one.
        started: A worker process that was started before, from `start_comparison_worker`.
    """
    if plan.engine == ENGINE:
        return ComparisonRuns(plan, [], 0)
    kept = read_comparison(folder) if complete else None
    if kept is not None and count is None:
        # It was made with another number of members, or by an older version.
        members = list(kept.members)
    else:
        members = members_to_compare(plan, count)
    # A stored comparison of these members is most likely that of these shards.
    is_stored = kept is not None and list(kept.members) == members
    is_long = plan.members >= MIN_FOR_WORKERS or len(members) > MEMBERS_PER_WORKER
    wants_workers = not is_stored and (is_long or started is not None)
    return ComparisonRuns(plan, members, processes - 1 if wants_workers else 0, started)


def compare_with_scipy(
    runs: ComparisonRuns,
    folder: SweepFolder,
    shards_digest: str,
    stop: Event,
    on_done: Callable[[int], None],
) -> ScipyComparison | None:
    """Return the comparison of a sweep with SciPy: from its folder if stored there, or a new one.

    Args:
        runs: The single runs.
        folder: The folder, with all shards.
        shards_digest: The digest of all shards.
        stop: Any thread may set it to end early.
        on_done: Called with the number of members that were run, whenever it has grown.

    Returns:
        The comparison, which is stored in the folder; None if it was stopped.

    Raises:
        StoreError: A shard is missing or damaged, or the comparison cannot be written.
    """
    kept = read_comparison(folder)
    if kept is not None and (kept.shards_digest, list(kept.members)) == (
        shards_digest,
        runs.members,
    ):
        return kept
    theirs = runs.finish(stop, on_done)
    if theirs is None:
        return None
    members, unlike, differences = runs.members, 0, dict[str, float]()
    if members:
        rows = _joined([theirs[member] for member in members])
        unlike, differences = compare(_stored(folder, members), rows)
    comparison = ScipyComparison(shards_digest, tuple(members), unlike, differences)
    write_document(folder.comparison_file, asdict(comparison))
    return comparison


def read_comparison(folder: SweepFolder) -> ScipyComparison | None:
    """Read the comparison of a sweep; None if the file is missing, damaged or of another sweep."""
    with suppress(StoreError):
        stored = read_model(folder.comparison_file, _StoredComparison)
        members = (-1, *stored.members, folder.manifest.members)
        known = set(stored.differences) <= set(folder.columns)
        if known and stored.unlike <= len(stored.members) and all(map(lt, members, members[1:])):
            return ScipyComparison(**dict(stored))
    return None


def _stored(folder: SweepFolder, members: list[int]) -> dict[str, Array]:
    """Return the stored columns of some members, whose numbers are ascending."""
    rows: list[dict[str, Array]] = []
    for number, some in groupby(members, lambda member: member // folder.manifest.shard_size):
        table = folder.read(number)
        if table is None:
            file = folder.shard_file(number)
            raise NotAResultError(f"{file} is missing or damaged; run the sweep again")
        chosen = np.array(list(some)) - folder.bounds(number)[0]
        rows.append({name: table.arrays[name][chosen] for name in table.layout})
    return _joined(rows)


def _joined(rows: list[dict[str, Array]]) -> dict[str, Array]:
    return {name: np.concatenate([row[name] for row in rows]) for name in rows[0]}
