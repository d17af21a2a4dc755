"""Events of a running sweep."""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from rbstab.sweep.folder.shard_inventory import ShardInventory
from rbstab.sweep.folder.sweep_folder import SweepFolder


class Started(NamedTuple):
    """The folder is open; its stored shards have been read.

    Args:
        folder: The folder.
        inventory: The stored and the missing shards.
        moved_aside: See `OpenFolder`.
        changed: See `OpenFolder`.
        members: The number of members of this sweep or part, with the stored ones.
    """

    folder: SweepFolder
    inventory: ShardInventory
    moved_aside: Path | None
    changed: tuple[str, ...]
    members: int


class ShardDone(NamedTuple):
    """A shard was computed and written: its number."""

    number: int


class Warned(NamedTuple):
    """Something happened that costs time or bits, but no member: a sentence about it."""

    text: str


class Comparing(NamedTuple):
    """Some members are being rerun with SciPy: `done` of `members` are finished."""

    done: int
    members: int


class Finishing(NamedTuple):
    """The members file is being written."""


SweepEvent = Started | ShardDone | Warned | Comparing | Finishing
"""Events of a sweep."""

EventCallback = Callable[[SweepEvent | None], None]
"""Called with each event in the executing thread, and with None when idle."""
