"""Rerun sampled members with SciPy, compare them with the stored ones, and keep the comparison."""

from collections.abc import Callable
from contextlib import closing, suppress
from dataclasses import asdict
from itertools import groupby
from operator import lt
from threading import Event
from typing import Annotated

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, NonNegativeInt

from rbstab.mechanics.numbers import Array
from rbstab.store.document import read_model, write_document
from rbstab.store.errors import NotAResultError, StoreError
from rbstab.sweep.execution.single_run_pool import run_singles
from rbstab.sweep.folder.sweep_folder import SweepFolder
from rbstab.sweep.members.scipy_comparison import (
    ENGINE,
    ScipyComparison,
    compare,
    members_to_compare,
)
from rbstab.sweep.plan.plan import Plan

_Difference = Annotated[float, Field(ge=0, allow_inf_nan=False)]


class _StoredComparison(BaseModel):
    """A `ScipyComparison`, as it is stored."""

    model_config = ConfigDict(extra="forbid")

    shards_digest: str
    members: tuple[int, ...]
    unlike: NonNegativeInt
    differences: dict[str, _Difference]


ComparedCallback = Callable[[int, int], None]
"""Called with the number of compared members, and the number of members to compare."""


def compare_with_scipy(  # noqa: PLR0913, PLR0917 (a sweep, its digest, and the control)
    plan: Plan,
    folder: SweepFolder,
    shards_digest: str,
    stop: Event,
    on_compared: ComparedCallback,
    processes: int = 1,
) -> ScipyComparison | None:
    """Return the comparison of a sweep with SciPy: from its folder if stored there, or a new one.

    Args:
        plan: The plan.
        folder: The folder, with all shards.
        shards_digest: The digest of all shards.
        stop: Any thread may set it to end early.
        on_compared: Called at the start and after each member.
        processes: The largest number of processes.

    Returns:
        The comparison, which is stored in the folder; None if it was stopped.

    Raises:
        StoreError: A shard is missing or damaged, or the comparison cannot be written.
    """
    kept = read_comparison(folder)
    if kept is not None and kept.shards_digest == shards_digest:
        return kept
    members = members_to_compare(plan, folder.manifest.plan_id)
    theirs = _run(plan, members, stop, on_compared, processes)
    if theirs is None:
        return None
    unlike, differences = compare(_stored(folder, members), _joined(theirs)) if members else (0, {})
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


def _run(
    plan: Plan, members: list[int], stop: Event, on_compared: ComparedCallback, processes: int
) -> list[dict[str, Array]] | None:
    """Return the outcomes of some members as single runs, in their order; None if stopped."""
    on_compared(0, len(members))
    outcomes: dict[int, dict[str, Array]] = {}
    with closing(run_singles(plan, ENGINE, members, processes)) as results:
        while not stop.is_set():
            try:
                found = next(results)
            except StopIteration:
                return [outcomes[member] for member in members]
            if found is not None:
                outcomes[found[0]] = found[1]
                on_compared(len(outcomes), len(members))
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
