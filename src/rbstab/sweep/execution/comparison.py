"""Run a few members again with SciPy, and compare them with the stored ones."""

from collections.abc import Callable
from itertools import groupby
from threading import Event

import numpy as np

from rbstab.mechanics.numbers import Array
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


def compare_with_scipy(  # noqa: PLR0913, PLR0917 (what is compared, and how)
    plan: Plan,
    folder: SweepFolder,
    shards_digest: str,
    count: int | None,
    kept: ScipyComparison | None,
    stop: Event,
    on_event: Callable[[Comparing], None],
) -> ScipyComparison | None:
    """Return the comparison of a sweep with SciPy: the one that is kept, or a new one.

    Args:
        plan: The plan.
        folder: The folder, with all shards.
        shards_digest: The digest of all shards.
        count: The number of members to compare; default: those of the kept comparison, or else
            see `members_to_compare`.
        kept: A comparison of these shards.
        stop: Any thread may set it to end early.
        on_event: Called before each member, and at the end.

    Returns:
        The comparison; None if it was stopped.

    Raises:
        StoreError: A shard is missing or damaged.
    """
    if kept is not None and count is None:
        return kept
    members = members_to_compare(plan, count)
    if kept is not None and list(kept.members) == members:
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
    return ScipyComparison(shards_digest, tuple(members), unlike, differences)


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
