"""Run a few members again with SciPy, and keep their differences to the stored ones."""

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
from rbstab.store.document import read_model, write_document
from rbstab.store.errors import StoreError
from rbstab.sweep.execution.events import Comparing
from rbstab.sweep.folder.sweep_folder import SweepFolder
from rbstab.sweep.members.scipy_comparison import (
    ENGINE,
    ScipyComparison,
    compare,
    members_to_compare,
)
from rbstab.sweep.members.single import SingleRuns
from rbstab.sweep.plan.plan import Plan

_Difference = Annotated[float, Field(ge=0, allow_inf_nan=False)]


class _StoredComparison(BaseModel):
    """A `ScipyComparison`, as it is stored."""

    model_config = ConfigDict(extra="forbid")

    shards_digest: str
    members: tuple[int, ...]
    unlike: NonNegativeInt
    differences: dict[str, _Difference]


def compare_with_scipy(  # noqa: PLR0913, PLR0917 (what is compared, and how)
    plan: Plan,
    folder: SweepFolder,
    shards_digest: str,
    count: int | None,
    stop: Event,
    on_event: Callable[[Comparing], None],
) -> ScipyComparison | None:
    """Return the comparison of a sweep with SciPy: from its folder if stored there, or a new one.

    Args:
        plan: The plan.
        folder: The folder, with all shards.
        shards_digest: The digest of all shards.
        count: The number of members to compare; default: those of a stored comparison, or else
            see `members_to_compare`.
        stop: Any thread may set it to end early.
        on_event: Called before each member, and at the end.

    Returns:
        The comparison, which is stored in the folder; None if it was stopped.

    Raises:
        StoreError: A shard is missing or damaged, or the comparison cannot be written.
    """
    kept = read_comparison(folder)
    members = list(kept.members) if kept and count is None else members_to_compare(plan, count)
    if kept is not None and (kept.shards_digest, list(kept.members)) == (shards_digest, members):
        return kept
    singles, rows = SingleRuns(plan, ENGINE, with_largest=True), []
    for done, member in enumerate(members):
        on_event(Comparing(done, len(members)))
        if stop.is_set():
            return None
        rows.append(singles.compute(member, member + 1).outcome)
    unlike, differences = 0, dict[str, float]()
    if members:
        on_event(Comparing(len(members), len(members)))
        unlike, differences = compare(_stored(folder, members), _joined(rows))
    comparison = ScipyComparison(shards_digest, tuple(members), unlike, differences)
    write_document(folder.comparison_file, asdict(comparison))
    return comparison


def read_comparison(folder: SweepFolder) -> ScipyComparison | None:
    """Read the comparison of a sweep; None if the file is missing, damaged or of another sweep."""
    with suppress(StoreError):
        stored = read_model(folder.comparison_file, _StoredComparison)
        members = (-1, *stored.members, folder.manifest.members)
        known = set(stored.differences) <= set(folder.manifest.columns)
        if known and stored.unlike <= len(stored.members) and all(map(lt, members, members[1:])):
            return ScipyComparison(**dict(stored))
    return None


def _stored(folder: SweepFolder, members: list[int]) -> dict[str, Array]:
    """Return the stored columns of some members, whose numbers are ascending."""
    rows: list[dict[str, Array]] = []
    for number, some in groupby(members, lambda member: member // folder.manifest.shard_size):
        table = folder.read(number)
        chosen = np.array(list(some)) - folder.bounds(number)[0]
        rows.append({name: table[name][chosen] for name in table.columns})
    return _joined(rows)


def _joined(rows: list[dict[str, Array]]) -> dict[str, Array]:
    return {name: np.concatenate([row[name] for row in rows]) for name in rows[0]}
