"""The folder of a sweep: its plan, manifest, shards, traces, and members file."""

import re
from bisect import bisect_left
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rbstab.files.shell_words import shell_word
from rbstab.mechanics.numbers import Array
from rbstab.store.dataset_file import Checksum, checksum_of
from rbstab.store.disk.existence import path_exists, path_is_file
from rbstab.store.errors import NotAResultError, StoreError
from rbstab.store.motions_file import write_motions
from rbstab.store.table import Column, Table
from rbstab.store.table_file import DIGEST, SHARD, read_table, write_table
from rbstab.store.variables import RUN
from rbstab.sweep.folder.manifest import Manifest, read_manifest
from rbstab.sweep.members.engine import FAILED_CODES
from rbstab.sweep.members.outcome import COLUMNS, STATUSES, final_columns, known_columns
from rbstab.sweep.members.traces import motions_of

PLAN_FILE = "plan.yaml"
SHARDS = "shards"
TRACES = "traces"
SWEEP_FILE = "members.h5"
COMPARISON_FILE = "check.json"
FILE_SUFFIX = ".h5"

_SHARD_NAME = re.compile(r"([0-9]{8})" + re.escape(FILE_SUFFIX))


class ShardFacts(NamedTuple):
    """Facts of a stored shard.

    Args:
        counts: The number of members with each status, by its code.
        first_failed: The first member that failed, if any.
        digest: The digest of the shard's file, which contains the digest of its traces if any.
        proved: The number of members whose convergence is proved, if the plan has `prove`.
    """

    counts: Array
    first_failed: int | None
    digest: str
    proved: int = 0


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
        return self.manifest.shards

    @property
    def sweep_file(self) -> Path:
        """The members file; it is there when all shards are stored."""
        return self.path / SWEEP_FILE

    @property
    def comparison_file(self) -> Path:
        """The file of the comparison with SciPy."""
        return self.path / COMPARISON_FILE

    @property
    def columns(self) -> dict[str, Column]:
        """The columns of the shards."""
        known = known_columns() | final_columns(self.manifest.states)
        return {name: known[name] for name in self.manifest.columns}

    @property
    def missing_columns(self) -> tuple[str, ...]:
        """Columns of this version of rbstab that the sweep lacks."""
        return tuple(name for name in COLUMNS if name not in self.manifest.columns)

    def shard_file(self, number: int) -> Path:
        """Return the file of a shard."""
        return self.path / SHARDS / f"{number:08d}{FILE_SUFFIX}"

    def traces_file(self, number: int) -> Path:
        """Return the file of the traces of a shard, if it has any."""
        return self.path / TRACES / f"{number:08d}{FILE_SUFFIX}"

    def has_traces(self, number: int) -> bool:
        """Return whether any member of a shard has a trace."""
        start, stop = self.bounds(number)
        keep = self.manifest.keep
        if keep.every:
            return keep.count(stop) > keep.count(start)
        return bisect_left(keep.members, start) < bisect_left(keep.members, stop)

    def stored_shards(self) -> set[int]:
        """Return the numbers of the shards that have a file, damaged or not.

        The folder is listed once. A sweep may have millions of shards, and few of them be stored.

        Raises:
            StoreError: The folder cannot be read.
        """
        try:
            names = [file.name for file in (self.path / SHARDS).iterdir()]
        except FileNotFoundError:
            return set()
        except OSError as error:
            raise StoreError(f"{self.path} cannot be read: {error.strerror or error}") from error
        numbers = (int(match[1]) for name in names if (match := _SHARD_NAME.fullmatch(name)))
        return {number for number in numbers if number < self.shards}

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
            numbers = start + np.flatnonzero(self.manifest.keep.selected(start, stop))
            motions = motions_of(traces, numbers, plan_id, self.manifest.states)
            checksum = write_motions(self.traces_file(number), motions)
            attributes |= {"traces_digest": checksum.digest, "traces_bytes": checksum.size}
        arrays, path = {RUN: np.arange(start, stop), **outcome}, self.shard_file(number)
        digest = write_table(path, SHARD, self.columns, arrays, attributes)
        return shard_facts(outcome, start, digest)

    def read(self, number: int, *, read_traces: bool = False) -> Table | None:
        """Read a shard; None if it is missing, damaged, of another sweep, or lacks its traces.

        Args:
            number: From 0.
            read_traces: Whether to read the whole file of the traces and compute its digest.
                Otherwise only its size and the digest at its end are compared.

        Raises:
            StoreError: The shard cannot be read, or was written by a newer rbstab.
        """
        path = self.shard_file(number)
        if not path_exists(path):
            return None
        try:
            table = self.columns_of(number)
        except NotAResultError:
            return None
        if self.has_traces(number):
            checksum = traces_checksum(table)
            if checksum is None or not self.has_whole_traces(number, checksum, read=read_traces):
                return None
        return table

    def columns_of(self, number: int, names: Iterable[str] | None = None) -> Table:
        """Read columns of a stored shard.

        Args:
            number: From 0.
            names: The columns; default all.

        Raises:
            NotAResultError: The shard is damaged, or is one of another sweep.
            StoreError: The shard cannot be read, or was written by a newer rbstab.
        """
        path, (start, stop) = self.shard_file(number), self.bounds(number)
        table, columns = read_table(path, SHARD, names), self.columns
        if "run_id" in table.layout:
            # Shards that were stored before the column was dropped have it.
            layout, arrays = dict(table.layout), dict(table.arrays)
            del layout["run_id"], arrays["run_id"]
            table = replace(table, layout=layout, arrays=arrays)
        ours = table.attributes.get("plan_id") == self.manifest.plan_id
        # The length is compared first: the manifest may be damaged, and shards be said to be huge.
        ours = ours and len(table[RUN]) == stop - start and table[RUN][0] == start
        ours = ours and set(table.layout) == set(columns if names is None else names)
        if not ours or not all(is_older(one, columns[n]) for n, one in table.layout.items()):
            raise NotAResultError(f"{path} is not a shard of this sweep")
        return table

    def has_whole_traces(self, number: int, checksum: Checksum, *, read: bool) -> bool:
        """Return whether the traces of a shard are those of a checksum; False if none are stored.

        Args:
            number: The shard.
            checksum: The digest and the size.
            read: Whether to read the whole file. Otherwise only its end is compared.

        Raises:
            StoreError: The file cannot be read.
        """
        path = self.traces_file(number)
        with suppress(NotAResultError):
            return path_exists(path) and checksum_of(path, check=read) == checksum
        return False

    def facts(self, number: int, *, read_traces: bool = False) -> ShardFacts | None:
        """Return the facts of a shard, or None in the same cases as `read`."""
        table = self.read(number, read_traces=read_traces)
        if table is None:
            return None
        return shard_facts(table.arrays, int(table[RUN][0]), str(table.attributes[DIGEST]))


def is_older(stored: Column, known: Column) -> bool:
    """Whether a column is stored as it is now, or was before words were added to its flags."""
    flags = known.flags[: len(stored.flags)]
    same = stored._replace(long_name=known.long_name) == known._replace(flags=flags)
    return same and bool(flags) == bool(known.flags)


def traces_checksum(shard: Table) -> Checksum | None:
    """Return the digest and the size of the traces of a shard, if it has any."""
    digest, size = (shard.attributes.get(f"traces_{name}") for name in ("digest", "bytes"))
    return Checksum(digest, size) if isinstance(digest, str) and type(size) is int else None


def shard_facts(arrays: Mapping[str, Array], first: int, digest: str) -> ShardFacts:
    """Return the facts of a shard.

    Args:
        arrays: The columns of the shard.
        first: The number of the first member.
        digest: The digest of its file.
    """
    status, proved = arrays["status"], arrays.get("proved_rest_state")
    failed = np.flatnonzero(np.isin(status, FAILED_CODES))
    counts = np.bincount(status, minlength=len(STATUSES))
    first_failed = int(first + failed[0]) if len(failed) else None
    count = 0 if proved is None else int(np.count_nonzero(proved > 0))
    return ShardFacts(counts, first_failed, digest, count)


def read_folder(path: Path) -> SweepFolder:
    """Read the manifest of a folder.

    Raises:
        NotAResultError: It is not the folder of a sweep, or its manifest is damaged.
        StoreError: It cannot be read, or was written by a newer rbstab.
    """
    return SweepFolder(path, read_manifest(path))


def unfinished_error(folder: SweepFolder) -> StoreError:
    """Return the error to raise when a sweep is not finished."""
    stored = len(folder.stored_shards())
    return StoreError(
        f"{folder.path} is a sweep that is not finished: {stored} of {folder.shards} shards are "
        f"stored. Resume it: {resuming_command(folder.path)}"
    )


def resuming_command(folder: Path) -> str:
    """Return the command that resumes the sweep in a folder, from any state.

    It names the copy of the plan in the folder: the plan of the user may have changed, another
    folder may have been given with `-o`, or the folder may have another name by now.
    """
    return f"rbstab sweep {_plan_words(folder)}"


def proving_member(folder: Path, member: int) -> str:
    """Return the command that runs a member of a sweep alone, and proves where its motion ends.

    Its result is beside the folder of the sweep, with the proofs.
    """
    return f"rbstab run {_plan_words(folder)} --member {member} --prove"


def _plan_words(folder: Path) -> str:
    """Return the plan of a sweep as a word of a command, and its folder of results as `-o`."""
    stored = folder / PLAN_FILE
    if not path_is_file(stored):
        return "PLAN.yaml"
    # The command names the folder after that of the plan, and puts it into `results` by default.
    # The parent of "." and of ".." is not written as a part of the path.
    results = folder.parent if folder.name not in ("", "..") else folder / ".."
    place = "" if results == Path("results") else f" -o {shell_word(results)}"
    return f"{shell_word(stored)}{place}"


def engine_of(path: Path) -> str | None:
    """Return the name of the engine of the sweep in a folder, if the folder has a sweep."""
    with suppress(StoreError):
        return read_folder(path).manifest.engine
    return None
