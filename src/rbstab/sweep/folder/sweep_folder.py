"""The folder of a sweep: its plan, its manifest, its shards, and the file that gathers them."""

from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.store.document import read_document
from rbstab.store.errors import NotAResultError, StoreError
from rbstab.store.motions_file import Stamp, stamp_of, write_motions
from rbstab.store.presence import path_exists
from rbstab.store.shard_file import DIGEST, SHARD, read_shard, write_shard
from rbstab.store.table import RUN, Head, Table
from rbstab.store.table_file import read_table
from rbstab.sweep.folder.layout import OUTCOME
from rbstab.sweep.members.engine import FAILED_CODES
from rbstab.sweep.members.outcome import STATUSES
from rbstab.sweep.members.traces import motions_of
from rbstab.sweep.plan.trace_selection import SUMMARY, TraceSelection

MANIFEST = "manifest.json"
PLAN_FILE = "plan.yaml"
SHARDS = "shards"
TRACES = "traces"
SWEEP_FILE = "sweep.h5"
COMPARISON_FILE = "check.json"

MANIFEST_VERSION = 2
"""Version 1 knew no traces, and its shards were HDF5."""


@dataclass(frozen=True)
class Manifest:
    """What stays fixed while a sweep goes on.

    Args:
        plan_id: Of its plan.
        title: Of its plan.
        members: How many there are.
        shard_size: Members of a shard; the last one may have fewer.
        engine: What follows them.
        versions: Of the program and of what computed it, at the beginning.
        keep: Which members have traces.
        schema_version: Of the folder.
    """

    plan_id: str
    title: str
    members: int
    shard_size: int
    engine: str
    versions: dict[str, str]
    keep: TraceSelection = SUMMARY
    schema_version: int = MANIFEST_VERSION


class ShardFacts(NamedTuple):
    """A whole shard: how many of its members ended how, the first that failed, and its digest.

    The digest is that of its file, which names that of its traces where it has some.
    """

    counts: Array
    first_failed: int | None
    digest: str


@dataclass(frozen=True)
class SweepFolder:
    """The folder of a sweep that was begun.

    Args:
        path: The folder.
        manifest: What stands in it.
    """

    path: Path
    manifest: Manifest

    @property
    def shards(self) -> int:
        """How many shards the sweep has."""
        return -(-self.manifest.members // self.manifest.shard_size)

    @property
    def sweep_file(self) -> Path:
        """Where the shards are gathered."""
        return self.path / SWEEP_FILE

    @property
    def comparison_file(self) -> Path:
        """Where the comparison with single runs is kept."""
        return self.path / COMPARISON_FILE

    def shard_file(self, number: int) -> Path:
        """The file of a shard."""
        return self.path / SHARDS / f"{number:08d}{SHARD}"

    def traces_file(self, number: int) -> Path:
        """The file of the traces of a shard, where any of its members has one."""
        return self.path / TRACES / f"{number:08d}.h5"

    def has_traces(self, number: int) -> bool:
        """Whether any member of a shard has a trace."""
        return bool(self.manifest.keep.traces(*self.bounds(number)).any())

    def bounds(self, number: int) -> tuple[int, int]:
        """The first member of a shard, and the one behind its last."""
        start = number * self.manifest.shard_size
        return start, min(start + self.manifest.shard_size, self.manifest.members)

    def members_of(self, numbers: Iterable[int]) -> int:
        """How many members these shards have."""
        return sum(stop - start for start, stop in map(self.bounds, numbers))

    def ranges(self, numbers: Iterable[int]) -> list[tuple[int, int]]:
        """The members of these shards, ascending, as bounds of ranges that do not touch."""
        found: list[tuple[int, int]] = []
        for start, stop in map(self.bounds, numbers):
            begins = found.pop()[0] if found and found[-1][1] == start else start
            found.append((begins, stop))
        return found

    def write(
        self, number: int, outcome: dict[str, Array], traces: dict[str, Array] | None = None
    ) -> ShardFacts:
        """Writes a shard, its traces first: a shard that is there has them, and names their digest.

        Args:
            number: From 0.
            outcome: Its columns.
            traces: Its traces, where any of its members has one.

        Returns:
            What is in it now.

        Raises:
            StoreError: The operating system refused.
        """
        start, stop = self.bounds(number)
        plan_id = self.manifest.plan_id
        attributes: dict[str, str | int | float] = {"plan_id": plan_id}
        if traces is not None:
            motions = motions_of(traces, self.manifest.keep, start, stop, plan_id)
            stamp = write_motions(self.traces_file(number), motions)
            attributes |= {"traces_digest": stamp.digest, "traces_bytes": stamp.size}
        head = Head(OUTCOME, start, stop - start, attributes)
        attributes[DIGEST] = write_shard(self.shard_file(number), head, outcome)
        return facts_of(outcome["status"], start, attributes)

    def read(self, number: int) -> Table | None:
        """A shard, or None where it is absent, damaged, none of this sweep, or without its traces.

        The traces are not read: their file has to have the size and the seal that the shard names.

        Args:
            number: From 0.

        Raises:
            StoreError: It cannot be read, or was written by a newer rbstab.
        """
        path = self.shard_file(number)
        if not path_exists(path):
            return None
        try:
            table = read_shard(path, OUTCOME)
        except NotAResultError:
            return None
        expected = np.arange(*self.bounds(number))
        ours = table.attributes.get("plan_id") == self.manifest.plan_id
        if not ours or not np.array_equal(table[RUN], expected):
            return None
        if self.has_traces(number):
            stamp = traces_stamp(table)
            if stamp is None or stamp != stamp_of(self.traces_file(number)):
                return None
        return table

    def facts(self, number: int) -> ShardFacts | None:
        """What is in a shard, or None as `read`."""
        table = self.read(number)
        if table is None:
            return None
        return facts_of(table["status"], int(table[RUN][0]), table.attributes)


def traces_stamp(shard: Table) -> Stamp | None:
    """What the traces of a shard are known by, if it has any."""
    found = [shard.attributes.get(f"traces_{what}") for what in ("digest", "bytes")]
    return Stamp(str(found[0]), int(found[1])) if found[1] is not None else None


def facts_of(status: Array, first: int, attributes: Mapping[str, str | int | float]) -> ShardFacts:
    """The facts of a shard.

    Args:
        status: Its column of statuses.
        first: The number of its first member.
        attributes: Those of its file, with its digest.
    """
    failed = np.flatnonzero(np.isin(status, FAILED_CODES))
    counts = np.bincount(status, minlength=len(STATUSES))
    first_failed = int(first + failed[0]) if len(failed) else None
    return ShardFacts(counts, first_failed, str(attributes[DIGEST]))


def read_folder(path: Path) -> SweepFolder:
    """The folder of a sweep, as it stands there.

    Raises:
        NotAResultError: It is none, or its manifest is damaged.
        StoreError: It cannot be read, or was written by a newer rbstab.
    """
    if not path_exists(path / MANIFEST):
        raise NotAResultError(f"{path} is not the folder of a sweep")
    data = read_document(path / MANIFEST)
    version = data.get("schema_version")
    if version == 1:
        raise NotAResultError(f"{path} was begun by an older rbstab")
    if version != MANIFEST_VERSION:
        raise StoreError(f"{path} was written by a newer rbstab, please update")
    try:
        keep = TraceSelection(**{**data["keep"], "members": tuple(data["keep"]["members"])})
        return SweepFolder(path, Manifest(**{**data, "keep": keep}))
    except (TypeError, KeyError) as error:
        raise NotAResultError(f"{path / MANIFEST} is damaged: {error}") from error


def open_sweep(path: str | Path) -> Table:
    """Reads a sweep: all members, with what is varied and what has become of them.

    Args:
        path: Its folder, or its file.

    Raises:
        NotAResultError: It is damaged, or no sweep.
        NewerSchemaError: It was written by a newer rbstab.
        StoreError: It cannot be opened, or the sweep is not finished.
    """
    path = Path(path)
    if not path.is_dir():
        return read_table(path)
    file = path / SWEEP_FILE
    if not path_exists(file):
        raise unfinished(read_folder(path))
    return read_table(file)


def unfinished(folder: SweepFolder) -> StoreError:
    """What is said of a sweep whose shards are not gathered."""
    there = sum(path_exists(folder.shard_file(number)) for number in range(folder.shards))
    return StoreError(
        f"{folder.path} is a sweep that is not finished: {there} of {folder.shards} shards are "
        "there; the `rbstab sweep` that began it goes on with it"
    )


def engine_of(path: Path) -> str | None:
    """The engine of the sweep that stands in a folder, if there is one."""
    with suppress(StoreError):
        return read_folder(path).manifest.engine
    return None
