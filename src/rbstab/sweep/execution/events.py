"""Events of a running sweep."""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from rbstab.sweep.folder.shard_inventory import ShardInventory
from rbstab.sweep.folder.sweep_folder import ShardFacts, SweepFolder


class Started(NamedTuple):
    """The folder is open; its stored shards have been read.

    Args:
        folder: The folder.
        inventory: The stored and the missing shards.
        moved_aside: See `OpenFolder`.
        changed_versions: See `OpenFolder`.
        members: The number of members of this sweep or part, with the stored ones.
    """

    folder: SweepFolder
    inventory: ShardInventory
    moved_aside: Path | None
    changed_versions: tuple[str, ...]
    members: int


class ShardDone(NamedTuple):
    """A shard was computed and written: its number, its number of members, and its facts."""

    number: int
    members: int
    facts: ShardFacts


class EngineFailed(NamedTuple):
    """The batch engine raised an error; members start to stop are rerun one by one."""

    start: int
    stop: int
    error: Exception


class Rescheduled(NamedTuple):
    """Members start to stop were not computed, because a worker died or raised an error.

    They run again; here says whether in this process.
    """

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
    """Sampled members are being rerun with SciPy: `done` of `members` are finished."""

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
