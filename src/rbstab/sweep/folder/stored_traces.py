"""The traces of a sweep as they are read: from the files of its shards, one at a time."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.store.errors import NotAResultError, StoreError
from rbstab.store.motions import Motions, joined
from rbstab.store.motions_file import check_motions, read_motions
from rbstab.store.presence import path_exists
from rbstab.store.shard_file import read_shard
from rbstab.sweep.folder.layout import OUTCOME
from rbstab.sweep.folder.sweep_folder import SweepFolder, read_folder, traces_stamp
from rbstab.sweep.members.traces import TIME

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True, eq=False)
class SweepTraces:
    """The motions that a sweep has kept, as far as it is done. `open_traces` makes one.

    A file is read to its end and compared with its digest when it is needed first.

    Args:
        folder: The folder of the sweep.
        shards: The shards whose traces are there, ascending.
    """

    folder: SweepFolder
    shards: tuple[int, ...]
    _checked: set[int] = field(default_factory=set, repr=False)

    @cached_property
    def members(self) -> Array:
        """The numbers of all members that have a trace, ascending."""
        return np.concatenate([self._members_of(shard) for shard in self.shards])

    @cached_property
    def times(self) -> Array:
        """The samples, shape (n,), s."""
        return self.of(int(self.members[0]))[TIME]

    def of(self, member: int) -> Motions:
        """The motion of one member: `traces.of(17)["lyapunov"]`, shape (n,) or (n, 3).

        Behind the last sample that a member reached everything is NaN.

        Raises:
            KeyError: It has no trace, or none yet.
            NotAResultError: The file is damaged.
            StoreError: It cannot be read.
        """
        shard = member // self.folder.manifest.shard_size
        numbers = self._members_of(shard) if shard in self.shards else np.array([], dtype=int)
        row = int(np.searchsorted(numbers, member))
        if row == len(numbers) or numbers[row] != member:
            raise KeyError(f"member {member} has no trace in {self.folder.path}")
        return read_motions(self._file(shard), row)

    def __len__(self) -> int:
        return len(self.members)

    def __iter__(self) -> Iterator[Motions]:
        """The motions of each shard together: arrays along `run`; one shard is in memory."""
        return (read_motions(self._file(shard)) for shard in self.shards)

    def to_xarray(self, members: Iterable[int]) -> "xarray.Dataset":
        """Some motions as an `xarray.Dataset` along `run`, `time` and `axis` (needs xarray).

        Args:
            members: Their numbers.

        Raises:
            KeyError, StoreError: As `of`.
            ValueError: There are none.
            ImportError: xarray is not installed.
        """
        found = [self.of(member) for member in members]
        if not found:
            raise ValueError("no members were given")
        return joined(found).to_xarray()

    def _members_of(self, shard: int) -> Array:
        start, stop = self.folder.bounds(shard)
        return start + np.flatnonzero(self.folder.manifest.keep.traces(start, stop))

    def _file(self, shard: int) -> Path:
        """The file of the traces of a shard, known to be what was written."""
        path = self.folder.traces_file(shard)
        if shard not in self._checked:
            try:
                stamp = traces_stamp(read_shard(self.folder.shard_file(shard), OUTCOME))
                if stamp is None:
                    raise NotAResultError(f"{self.folder.shard_file(shard)} has no traces")
                check_motions(path, stamp)
            except NotAResultError as error:
                raise NotAResultError(
                    f"{error}; remove {path}, and `rbstab sweep` computes its members again"
                ) from error
            self._checked.add(shard)
        return path


def open_traces(path: str | Path) -> SweepTraces:
    """The motions that a sweep has kept; see `keep` of a plan. They need not fit into memory.

    Args:
        path: The folder of the sweep, which may be unfinished.

    Raises:
        NotAResultError: It is no folder of a sweep.
        StoreError: It has no traces, or cannot be read.
    """
    folder = read_folder(Path(path))
    shards = tuple(
        number
        for number in range(folder.shards)
        if folder.has_traces(number)
        and path_exists(folder.shard_file(number))
        and path_exists(folder.traces_file(number))
    )
    if not shards:
        kept = folder.manifest.keep.count(folder.manifest.members)
        why = "none of them is done yet" if kept else "its plan keeps none"
        raise StoreError(f"{path} has no traces: {why}")
    return SweepTraces(folder, shards)
