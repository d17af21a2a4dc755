"""Events of a running sweep."""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from rbstab.sweep.folder.shard_inventory import ShardInventory
from rbstab.sweep.folder.sweep_folder import ShardFacts, SweepFolder


class Started(NamedTuple):
    """The folder is open; its stored shards have been read.

    inventory lists the shards that are stored and those that are missing; moved_aside and
    changed_versions are those of `OpenFolder`; members is how many this process has to have done
    in the end, those that are stored included.
    """

    folder: SweepFolder
    inventory: ShardInventory
    moved_aside: Path | None
    changed_versions: tuple[str, ...]
    members: int


class ShardDone(NamedTuple):
    """A shard was computed and written: its number, how many members it has, and its facts."""

    number: int
    members: int
    facts: ShardFacts


class EngineFailed(NamedTuple):
    """The batch engine raised an error; members start to stop are rerun one by one."""

    start: int
    stop: int
    error: Exception


class Rescheduled(NamedTuple):
    """The worker computing members start to stop died; they run again (here: in this process)."""

    start: int
    stop: int
    error: BaseException
    here: bool


class ProcessorDiffers(NamedTuple):
    """A shard was computed on another kind of processor than this process has."""

    name: str


class NoWorkers(NamedTuple):
    """No worker is connected; waiting."""


class Comparing(NamedTuple):
    """Members are being rerun with SciPy: how many are done, of how many."""

    done: int
    members: int


class Gathering(NamedTuple):
    """The shards are being gathered into one file."""


ExecutionEvent = ShardDone | EngineFailed | Rescheduled | ProcessorDiffers | NoWorkers
"""Events of an executor."""

SweepEvent = Started | ExecutionEvent | Comparing | Gathering
"""Events of a sweep."""

EventCallback = Callable[[SweepEvent | None], None]
"""Called with each event in the executing thread, and with None when idle."""
