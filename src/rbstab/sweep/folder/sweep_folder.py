"""The folder of a sweep: its plan, manifest, shards, traces, and the file of all shards."""

from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.store.document import read_document
from rbstab.store.errors import NotAResultError, StoreError
from rbstab.store.existence import path_exists
from rbstab.store.motions_file import FileChecksum, read_checksum, write_motions
from rbstab.store.shard_file import DIGEST, SHARD_SUFFIX, read_shard, write_shard
from rbstab.store.table import RUN, Column, Table, TableHeader
from rbstab.store.table_file import read_table
from rbstab.sweep.members.engine import FAILED_CODES
from rbstab.sweep.members.outcome import COLUMNS, STATUSES
from rbstab.sweep.members.traces import motions_of
from rbstab.sweep.plan.trace_selection import NO_TRACES, TraceSelection

MANIFEST = "manifest.json"
PLAN_FILE = "plan.yaml"
SHARDS = "shards"
TRACES = "traces"
SWEEP_FILE = "sweep.h5"
COMPARISON_FILE = "check.json"

MANIFEST_VERSION = 2
"""Version 1 had no traces, and its shards were HDF5."""


FIRST_COLUMNS = (
    "run_id",
    "status",
    "end_time",
    "final_orientation",
    "final_angular_velocity",
    "final_position",
    "final_velocity",
    "final_connector_state",
    "lyapunov_start",
    "lyapunov_end",
    "energy_residual",
    "peak_contact_displacement",
    "peak_time",
    "peak_orientation",
    "smallest_regularity",
    "settling_time",
    "displacement_settling_time",
    "steps",
)
"""The columns of older folders. Their manifests do not list columns."""


@dataclass(frozen=True)
class Manifest:
    """The properties of a sweep that do not change while it runs.

    Args:
        plan_id: The identity of the plan.
        title: The title of the plan.
        members: The number of members.
        shard_size: Members of a shard; the last one may have fewer.
        engine: The name of the engine.
        versions: The versions of rbstab and its libraries when the sweep was started.
        keep: The members with traces.
        columns: The columns of the shards, set by the version of rbstab that started the sweep.
        schema_version: The version of the folder's format.
    """

    plan_id: str
    title: str
    members: int
    shard_size: int
    engine: str
    versions: dict[str, str]
    keep: TraceSelection = NO_TRACES
    columns: tuple[str, ...] = FIRST_COLUMNS
    schema_version: int = MANIFEST_VERSION


class ShardFacts(NamedTuple):
    """Facts of a stored shard.

    Args:
        counts: The number of members with each status, by its code.
        first_failed: The first member that failed, if any.
        digest: The digest of the shard's file, which contains the digest of its traces if any.
    """

    counts: Array
    first_failed: int | None
    digest: str


@dataclass(frozen=True)
class SweepFolder:
    """The folder of a sweep that was started.

    Args:
        path: The folder.
        manifest: The properties of the sweep.
    """

    path: Path
    manifest: Manifest

    @property
    def shards(self) -> int:
        """The number of shards."""
        return -(-self.manifest.members // self.manifest.shard_size)

    @property
    def sweep_file(self) -> Path:
        """The file with all gathered shards."""
        return self.path / SWEEP_FILE

    @property
    def comparison_file(self) -> Path:
        """The file of the comparison with SciPy."""
        return self.path / COMPARISON_FILE

    @property
    def columns(self) -> dict[str, Column]:
        """The columns of the shards."""
        return {name: COLUMNS[name] for name in self.manifest.columns}

    @property
    def missing_columns(self) -> tuple[str, ...]:
        """Columns of this version of rbstab that the sweep lacks."""
        return tuple(name for name in COLUMNS if name not in self.manifest.columns)

    def shard_file(self, number: int) -> Path:
        """Return the file of a shard."""
        return self.path / SHARDS / f"{number:08d}{SHARD_SUFFIX}"

    def traces_file(self, number: int) -> Path:
        """Return the file of the traces of a shard, if it has any."""
        return self.path / TRACES / f"{number:08d}.h5"

    def has_traces(self, number: int) -> bool:
        """Return whether any member of a shard has a trace."""
        return bool(self.manifest.keep.selected(*self.bounds(number)).any())

    def bounds(self, number: int) -> tuple[int, int]:
        """Return the range of members of a shard: the first, and one after the last."""
        start = number * self.manifest.shard_size
        return start, min(start + self.manifest.shard_size, self.manifest.members)

    def members_of(self, numbers: Iterable[int]) -> int:
        """Return the number of members of these shards."""
        return sum(stop - start for start, stop in map(self.bounds, numbers))

    def ranges(self, numbers: Iterable[int]) -> list[tuple[int, int]]:
        """Return the members of these shards as ranges (start, stop), ascending and merged."""
        found: list[tuple[int, int]] = []
        for start, stop in map(self.bounds, numbers):
            first = found.pop()[0] if found and found[-1][1] == start else start
            found.append((first, stop))
        return found

    def write(
        self, number: int, outcome: dict[str, Array], traces: dict[str, Array] | None = None
    ) -> ShardFacts:
        """Write a shard.

        The traces are written first. So every stored shard has its traces and their digest.

        Args:
            number: From 0.
            outcome: The columns of the shard.
            traces: The traces of the shard, if it has any.

        Returns:
            The facts of the shard.

        Raises:
            StoreError: A file cannot be written.
        """
        start, stop = self.bounds(number)
        plan_id = self.manifest.plan_id
        attributes: dict[str, str | int | float] = {"plan_id": plan_id}
        if traces is not None:
            motions = motions_of(traces, self.manifest.keep, start, stop, plan_id)
            checksum = write_motions(self.traces_file(number), motions)
            attributes |= {"traces_digest": checksum.digest, "traces_bytes": checksum.size}
        head = TableHeader(self.columns, start, stop - start, attributes)
        attributes[DIGEST] = write_shard(self.shard_file(number), head, outcome)
        return shard_facts(outcome["status"], start, attributes)

    def read(self, number: int) -> Table | None:
        """Read a shard; None if it is missing, damaged, of another sweep, or lacks its traces.

        The traces are not read. Only the size and the digest at the end of their file are compared
        with those in the shard.

        Args:
            number: From 0.

        Raises:
            StoreError: The shard cannot be read, or was written by a newer rbstab.
        """
        path = self.shard_file(number)
        if not path_exists(path):
            return None
        try:
            table = read_shard(path, self.columns)
        except NotAResultError:
            return None
        expected = np.arange(*self.bounds(number))
        ours = table.attributes.get("plan_id") == self.manifest.plan_id
        if not ours or not np.array_equal(table[RUN], expected):
            return None
        if self.has_traces(number):
            checksum = traces_checksum(table)
            if checksum is None or checksum != read_checksum(self.traces_file(number)):
                return None
        return table

    def facts(self, number: int) -> ShardFacts | None:
        """Return the facts of a shard, or None in the same cases as `read`."""
        table = self.read(number)
        if table is None:
            return None
        return shard_facts(table["status"], int(table[RUN][0]), table.attributes)


def traces_checksum(shard: Table) -> FileChecksum | None:
    """Return the digest and the size of the traces of a shard, if it has any."""
    found = [shard.attributes.get(f"traces_{name}") for name in ("digest", "bytes")]
    return FileChecksum(str(found[0]), int(found[1])) if found[1] is not None else None


def shard_facts(
    status: Array, first: int, attributes: Mapping[str, str | int | float]
) -> ShardFacts:
    """Return the facts of a shard.

    Args:
        status: The status of each member, shape (m,).
        first: The number of the first member.
        attributes: The attributes of the file, with its digest.
    """
    failed = np.flatnonzero(np.isin(status, FAILED_CODES))
    counts = np.bincount(status, minlength=len(STATUSES))
    first_failed = int(first + failed[0]) if len(failed) else None
    return ShardFacts(counts, first_failed, str(attributes[DIGEST]))


def read_folder(path: Path) -> SweepFolder:
    """Read the manifest of a folder.

    Raises:
        NotAResultError: It is not the folder of a sweep, or its manifest is damaged.
        StoreError: It cannot be read, or was written by a newer rbstab.
    """
    if not path_exists(path / MANIFEST):
        raise NotAResultError(f"{path} is not the folder of a sweep")
    data = read_document(path / MANIFEST)
    version = data.get("schema_version")
    if version == 1:
        raise NotAResultError(
            f"{path} was written by an older rbstab; run the sweep in a new folder"
        )
    if version != MANIFEST_VERSION:
        raise StoreError(f"{path} was written by a newer rbstab; update rbstab")
    try:
        keep = TraceSelection(**{**data["keep"], "members": tuple(data["keep"]["members"])})
        columns = tuple(data.get("columns", FIRST_COLUMNS))
        manifest = Manifest(**{**data, "keep": keep, "columns": columns})
    except (TypeError, KeyError) as error:
        raise NotAResultError(f"{path / MANIFEST} is damaged: {error}") from error
    unknown = [name for name in columns if name not in COLUMNS]
    if unknown:
        raise StoreError(
            f"{path} has columns of a newer rbstab ({', '.join(map(str, unknown))}); update rbstab"
        )
    return SweepFolder(path, manifest)


def open_sweep(path: str | Path) -> Table:
    """Read a finished sweep: the values of the varied keys and the results of all members.

    Args:
        path: The folder of the sweep, or its file.

    Raises:
        NotAResultError: The file is damaged, or is not a sweep.
        NewerSchemaError: The file was written by a newer rbstab.
        StoreError: The file cannot be opened, or the sweep is not finished.
    """
    path = Path(path)
    if not path.is_dir():
        return read_table(path)
    file = path / SWEEP_FILE
    if not path_exists(file):
        raise unfinished_error(read_folder(path))
    return read_table(file)


def unfinished_error(folder: SweepFolder) -> StoreError:
    """Return the error to raise when the shards of a sweep are not gathered yet."""
    stored = sum(path_exists(folder.shard_file(number)) for number in range(folder.shards))
    return StoreError(
        f"{folder.path} is a sweep that is not finished: {stored} of {folder.shards} shards are "
        "stored. Run the same `rbstab sweep` command again to resume it"
    )


def engine_of(path: Path) -> str | None:
    """Return the name of the engine of the sweep in a folder, if the folder has a sweep."""
    with suppress(StoreError):
        return read_folder(path).manifest.engine
    return None
