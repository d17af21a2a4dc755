"""Whether the fast engine is right: one in a thousand members again, as a single run by SciPy."""

import hashlib
from collections.abc import Callable
from contextlib import closing
from dataclasses import asdict, dataclass
from itertools import groupby
from pathlib import Path
from threading import Event

import numpy as np

from rbstab.config.source import key_of
from rbstab.mechanics.numbers import Array
from rbstab.store.document import read_document, write_document
from rbstab.store.errors import NotAResultError, StoreError
from rbstab.sweep.execution.single_run_pool import run_singles
from rbstab.sweep.folder.sweep_folder import SweepFolder
from rbstab.sweep.members.outcome import COLUMNS
from rbstab.sweep.plan.axes import VARIANT
from rbstab.sweep.plan.plan import Plan

ENGINE = "scipy"

SHARE = 1000
"""One of so many members is repeated."""

_NOT_COMPARED = ("run_id", "status", "steps")

_MEASURE = {"energy_residual": "lyapunov_start"}
"""What a column is compared with, where it is nothing but error itself."""


@dataclass(frozen=True)
class Check:
    """The comparison of some members with single runs.

    Args:
        shards_digest: Of the shards that were compared.
        members: The members.
        unlike: How many ended otherwise, or have a number where there is none in the single run.
        differences: For each column the largest difference, over the largest number in it.
    """

    shards_digest: str
    members: tuple[int, ...]
    unlike: int
    differences: dict[str, float]


def members_to_check(plan: Plan, seed: str) -> list[int]:
    """A random member of every thousand, of the variants that are comparable.

    Args:
        plan: The plan.
        seed: The same seed gives the same members.
    """
    found = []
    for start in range(0, plan.members, SHARE):
        stop = min(start + SHARE, plan.members)
        digest = hashlib.sha256(f"{seed} {start}".encode()).digest()
        member = start + int.from_bytes(digest[:8], "big") % (stop - start)
        values = plan.values(member, member + 1, [key_of(VARIANT)])
        if is_comparable(plan.variant_of({key: column[0] for key, column in values.items()})):
            found.append(member)
    return found


def is_comparable(variant: str) -> bool:
    """Whether two engines find the same motions of a variant: not where it may be chaotic."""
    return variant != "sliding"


def check_of(  # noqa: PLR0913, PLR0917 (what is compared, and how that is told and stopped)
    plan: Plan,
    folder: SweepFolder,
    shards_digest: str,
    stop: Event,
    on_event: Callable[[int, int], None],
    processes: int = 1,
) -> Check | None:
    """The check of a sweep whose shards are all there: that of its folder, or a new one.

    Args:
        plan: The plan.
        folder: The folder.
        shards_digest: Of all its shards.
        stop: Set when it is to end early.
        on_event: Called with how many members were compared, and how many are to be.
        processes: How many may follow them.

    Returns:
        The check, which is kept in the folder; None where it was stopped.

    Raises:
        StoreError: A shard is not there any more, or the check cannot be written.
    """
    kept = kept_check(folder.check_file)
    if kept is not None and kept.shards_digest == shards_digest:
        return kept
    members = members_to_check(plan, folder.manifest.plan_id)
    theirs = _followed(plan, members, stop, on_event, processes)
    if theirs is None:
        return None
    unlike, differences = (
        compared(_stored(folder, members), _joined(theirs)) if members else (0, {})
    )
    check = Check(shards_digest, tuple(members), unlike, differences)
    write_document(folder.check_file, asdict(check))
    return check


def _followed(
    plan: Plan,
    members: list[int],
    stop: Event,
    on_event: Callable[[int, int], None],
    processes: int,
) -> list[dict[str, Array]] | None:
    """The outcomes of some members as single runs, in their order; None where it was stopped."""
    on_event(0, len(members))
    outcomes: dict[int, dict[str, Array]] = {}
    with closing(run_singles(plan, ENGINE, members, processes)) as coming:
        while not stop.is_set():
            try:
                found = next(coming)
            except StopIteration:
                return [outcomes[member] for member in members]
            if found is not None:
                outcomes[found[0]] = found[1]
                on_event(len(outcomes), len(members))
    return None


def kept_check(path: Path) -> Check | None:
    """The check that is kept in a file; None where it is absent or damaged."""
    try:
        data = read_document(path)
        return Check(**{**data, "members": tuple(data["members"])})
    except (StoreError, TypeError, KeyError):
        return None


def compared(ours: dict[str, Array], theirs: dict[str, Array]) -> tuple[int, dict[str, float]]:
    """How many members are unlike, and the largest differences of all others; see `Check`."""
    columns = [column.name for column in COLUMNS if column.name not in _NOT_COMPARED]
    alike = ours["status"] == theirs["status"]
    for name in columns:
        same = np.isnan(ours[name]) == np.isnan(theirs[name])
        alike &= same.reshape(len(same), -1).all(axis=1)
    differences = {}
    for name in columns:
        a, b, measure = (
            np.nan_to_num(values[alike])
            for values in (ours[name], theirs[name], theirs[_MEASURE.get(name, name)])
        )
        # Infinite numbers are those of diverged motions; that they diverge is all that counts.
        finite = np.isfinite(a) & np.isfinite(b)
        largest = float(np.abs(measure[np.isfinite(measure)]).max(initial=0.0))
        difference = float(np.abs(a[finite] - b[finite]).max(initial=0.0))
        differences[name] = difference / largest if largest else difference
    return int((~alike).sum()), differences


def _stored(folder: SweepFolder, members: list[int]) -> dict[str, Array]:
    """The stored columns of some members, ascending."""
    rows: list[dict[str, Array]] = []
    for number, some in groupby(members, lambda member: member // folder.manifest.shard_size):
        table = folder.read(number)
        if table is None:
            raise NotAResultError(f"{folder.shard_file(number)} was lost; run the sweep again")
        chosen = np.array(list(some)) - folder.bounds(number)[0]
        rows.append({name: table.arrays[name][chosen] for name in table.layout})
    return _joined(rows)


def _joined(rows: list[dict[str, Array]]) -> dict[str, Array]:
    return {name: np.concatenate([row[name] for row in rows]) for name in rows[0]}
