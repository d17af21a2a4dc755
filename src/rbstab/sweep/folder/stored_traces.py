"""Read the traces of a sweep from the files of its shards, one file at a time."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rbstab.files.text import line
from rbstab.mechanics.numbers import Array
from rbstab.store.dataset import MOTIONS, Motions, stack_motions
from rbstab.store.dataset_file import read_dataset
from rbstab.store.disk.paths import path_exists
from rbstab.store.errors import NotAResultError, StoreError
from rbstab.store.variables import RUN, Variable, dataset_of, make_read_only
from rbstab.sweep.folder.sweep_folder import SweepFolder, read_folder
from rbstab.sweep.folder.sweep_table import read_members_file
from rbstab.sweep.members.traces import TIME

if TYPE_CHECKING:
    import xarray


@dataclass(frozen=True, eq=False, repr=False)
class SweepTraces:
    """The traces (stored trajectories) of the members of a sweep, made by `open_traces`.

    The sweep may be unfinished. When a file is first used, it is read completely and compared with
    its digest.

    Args:
        folder: The folder of the sweep.
        shards: The shards with stored traces, ascending.
    """

    folder: SweepFolder
    shards: tuple[int, ...]
    _checked: set[int] = field(default_factory=set, repr=False)

    @cached_property
    def members(self) -> Array:
        """The numbers of all members with stored traces, ascending; shape (k,)."""
        members = np.concatenate([self.folder.traced(shard) for shard in self.shards])
        make_read_only([members])
        return members

    @cached_property
    def times(self) -> Array:
        """The sample times, shape (n,), s."""
        return self.of(int(self.members[0]))[TIME]

    def of(self, member: int) -> Motions:
        """Return the trace of one member: `traces.of(17)["lyapunov"]`, shape (n,) or (n, 3).

        All quantities are NaN after the last sample that the member reached.

        Raises:
            KeyError: The member has no stored trace.
            NotAResultError: The file is damaged.
            StoreError: The file cannot be read.
        """
        shard = member // self.folder.manifest.shard_size
        numbers = self.folder.traced(shard) if shard in self.shards else np.array([], dtype=int)
        row = int(np.searchsorted(numbers, member))
        if row == len(numbers) or numbers[row] != member:
            raise KeyError(f"member {member} has no trace in {self.folder.path}")
        return read_dataset(self._file(shard), MOTIONS, row=row, form=Motions)

    def __repr__(self) -> str:
        """Return one line: title, folder, how many members have a trace."""
        title, count = self.folder.manifest.title, len(self)
        return line("SweepTraces", title, [f"{count} members with traces", str(self.folder.path)])

    def __len__(self) -> int:
        return len(self.members)

    def __iter__(self) -> Iterator[Motions]:
        """Yield the traces of each shard, as arrays along `run`, with one shard in memory."""
        return (read_dataset(self._file(n), MOTIONS, form=Motions) for n in self.shards)

    def to_xarray(self, members: Iterable[int]) -> "xarray.Dataset":
        """Return some traces as an `xarray.Dataset` along `run`, `time` and `axis` (needs xarray).

        Of a finished sweep, the varied keys are coordinates along `run`.

        Args:
            members: The numbers of the members.

        Raises:
            KeyError, StoreError: As `of`.
            ValueError: No members are given.
            ImportError: xarray is not installed.
        """
        traces = [self.of(member) for member in members]
        if not traces:
            raise ValueError("no members were given")
        motions = stack_motions(traces)
        varied = self._varied_values(motions[RUN])
        return dataset_of({**motions.variables, **varied}, motions.attributes, varied)

    def _varied_values(self, members: Array) -> dict[str, Variable]:
        """Return the values of the varied keys; none if the sweep is not finished."""
        if not path_exists(self.folder.sweep_file):
            return {}
        table = read_members_file(self.folder, read_members_file(self.folder, ()).varied)
        values = {name: table.varied_values(name) for name in table.varied}
        return {name: v._replace(data=v.data[members]) for name, v in values.items()}

    def _file(self, shard: int) -> Path:
        """Return the file of the traces of a shard, verified by its digest."""
        path = self.folder.traces_file(shard)
        if shard not in self._checked:
            try:
                if not self.folder.has_whole_traces(shard, self.folder.read(shard, ()), read=True):
                    raise NotAResultError(f"{path} is damaged: it is not the file of its shard")
            except NotAResultError as error:
                raise NotAResultError(
                    f"{error}. Remove {path} and run `rbstab sweep` again to recompute its members"
                ) from error
            self._checked.add(shard)
        return path


def open_traces(path: str | Path) -> SweepTraces:
    """Open the traces of a sweep: the trajectories of the members that `keep` in its plan selects.

    Args:
        path: The folder of the sweep, which may be unfinished.

    Returns:
        The traces, which are read one member at a time, because they may be larger than memory.

    Raises:
        NotAResultError: It is not the folder of a sweep.
        StoreError: It has no traces, or cannot be read.
    """
    folder = read_folder(Path(path))
    shards = tuple(
        number
        for number in sorted(folder.stored_shards())
        if len(folder.traced(number)) and path_exists(folder.traces_file(number))
    )
    if not shards:
        kept = folder.manifest.keep.count(folder.manifest.members)
        why = "none is stored yet" if kept else "its plan stores none"
        raise StoreError(f"{path} has no traces: {why}")
    return SweepTraces(folder, shards)
