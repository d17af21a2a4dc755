"""The folder of a sweep: its plan, manifest, shards, traces, and members file.

A shard is final: it appears whole, is sealed, and repeats the manifest's id. So shards need no
locks: of two processes that compute one, each writes the same bytes.
"""

import re
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from rbstab.files.text import shell_word
from rbstab.mechanics.numbers import Array
from rbstab.store.dataset import MOTIONS
from rbstab.store.dataset_file import checksum_of, write_dataset
from rbstab.store.disk.paths import path_exists, path_is_file, store_errors
from rbstab.store.errors import NotAResultError, StoreError
from rbstab.store.table import Table, columns_from, read_table
from rbstab.store.variables import RUN
from rbstab.sweep.folder.manifest import Manifest, read_manifest
from rbstab.sweep.members.engine import Shard
from rbstab.sweep.members.outcome import columns_of, shard_columns
from rbstab.sweep.members.traces import layout_of
from rbstab.sweep.plan.plan import Plan

PLAN_FILE = "plan.yaml"
SHARDS = "shards"
TRACES = "traces"
SWEEP_FILE = "members.h5"
FILE_SUFFIX = ".h5"

SHARD = "a shard of a sweep"
"""The kind of the files of shards."""

_SHARD_NAME = re.compile(r"([0-9]{8})" + re.escape(FILE_SUFFIX))


@dataclass(frozen=True)
class SweepFolder:
    """The folder of a sweep.

    Args:
        path: The folder.
        manifest: The properties of the sweep.
        id: The id of the manifest; empty if the sweep was not started.
    """

    path: Path
    manifest: Manifest
    id: str = ""

    @property
    def shards(self) -> int:
        """The number of shards."""
        return self.manifest.shards

    @property
    def sweep_file(self) -> Path:
        """The members file; it is there when all shards are stored."""
        return self.path / SWEEP_FILE

    def shard_file(self, number: int) -> Path:
        """Return the file of a shard."""
        return self.path / SHARDS / f"{number:08d}{FILE_SUFFIX}"

    def traces_file(self, number: int) -> Path:
        """Return the file of the traces of a shard, if it has any."""
        return self.path / TRACES / f"{number:08d}{FILE_SUFFIX}"

    def traced(self, number: int) -> Array:
        """Return the members of a shard that have traces, ascending."""
        start, stop = self.bounds(number)
        traced: Array = start + np.flatnonzero(self.manifest.keep.selected(start, stop))
        return traced

    def stored_shards(self) -> set[int]:
        """Return the numbers of the shards that have a file, damaged or not.

        The folder is listed once. A sweep may have millions of shards, and few of them be stored.

        Raises:
            StoreError: The folder cannot be read.
        """
        names: list[str] = []
        with store_errors(self.path, "read"), suppress(FileNotFoundError):
            names = [file.name for file in (self.path / SHARDS).iterdir()]
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
        merged: list[tuple[int, int]] = []
        for start, stop in map(self.bounds, numbers):
            first = merged.pop()[0] if merged and merged[-1][1] == start else start
            merged.append((first, stop))
        return merged

    def write(self, plan: Plan, number: int, shard: Shard) -> Table:
        """Write a shard.

        The traces are written first. So every stored shard has its traces and their digest.

        Args:
            plan: The plan.
            number: From 0.
            shard: The results of its members.

        Returns:
            What was written.

        Raises:
            StoreError: A file cannot be written.
        """
        start, stop = self.bounds(number)
        attributes: dict[str, str | int | float] = {"manifest": self.id}
        if shard.traces is not None:
            numbers, plan_id = self.traced(number), self.manifest.plan_id
            motions = layout_of(plan).motions(shard.traces, numbers, plan_id)
            file = self.traces_file(number)
            checksum = write_dataset(file, replace(motions, kind=MOTIONS), replace=True)
            attributes |= {"traces_digest": checksum.digest, "traces_bytes": checksum.size}
        columns = columns_of(plan)
        layout = {name: columns[name] for name in self.manifest.columns}
        arrays: Mapping[str, Array] = {RUN: np.arange(start, stop), **shard.outcome}
        table = Table(columns_from(layout, arrays), attributes, kind=SHARD)
        digest = write_dataset(self.shard_file(number), table, replace=True).digest
        return replace(table, digest=digest)

    def read(self, number: int, names: Iterable[str] | None = None) -> Table:
        """Read a stored shard.

        Args:
            number: From 0.
            names: The columns; default all.

        Raises:
            NotAResultError: The shard is damaged, or is one of another sweep.
            StoreError: The shard cannot be read, or was written by a newer rbstab.
        """
        path, (start, stop) = self.shard_file(number), self.bounds(number)
        wanted = set(self.manifest.columns if names is None else names)
        table, columns = read_table(path, SHARD, None if names is None else wanted), shard_columns()
        fits = table.attributes.get("manifest") == self.id
        # The length is compared first: the manifest may be damaged, and shards be said to be huge.
        fits = fits and len(table[RUN]) == stop - start and table[RUN][0] == start
        fits = fits and set(table.columns) == wanted
        # The final values of own states of named elements are known to their plan alone.
        if not fits or not all(
            columns[name].describes(table.variables[name])
            if name in columns
            else table[name].dtype.kind == "f"
            for name in wanted
        ):
            raise NotAResultError(f"{path} is not a shard of this sweep")
        return table

    def has_whole_traces(self, number: int, shard: Table, *, read: bool) -> bool:
        """Return whether the traces of a shard are stored, if it has any.

        Args:
            number: The shard.
            shard: Its table.
            read: Whether to read the whole file. Otherwise only its end is compared.

        Raises:
            StoreError: The file cannot be read.
        """
        if not len(self.traced(number)):
            return True
        path = self.traces_file(number)
        written = tuple(shard.attributes.get(f"traces_{name}") for name in ("digest", "bytes"))
        with suppress(NotAResultError):
            return path_exists(path) and checksum_of(path, check=read) == written
        return False


def read_folder(path: Path) -> SweepFolder:
    """Read the manifest of a folder.

    Raises:
        NotAResultError: It is not the folder of a sweep, or its manifest is damaged.
        StoreError: It cannot be read, or was written by a newer rbstab.
    """
    return SweepFolder(path, *read_manifest(path))


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
