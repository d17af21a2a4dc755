"""What happens while a sweep is executed."""

from collections.abc import Callable
from typing import NamedTuple

from rbstab.sweep.folder.sweep_folder import ShardFacts


class ShardDone(NamedTuple):
    """A shard was computed and written: its number, how many members it has, and its facts."""

    number: int
    members: int
    facts: ShardFacts


class EngineFailed(NamedTuple):
    """An engine raised an error on members start to stop, which are followed one by one instead."""

    start: int
    stop: int
    error: Exception


class Rescheduled(NamedTuple):
    """Who computed members start to stop was lost; they are computed again (here: by us)."""

    start: int
    stop: int
    error: BaseException
    here: bool


class ProcessorDiffers(NamedTuple):
    """Shards come from a processor that is not of the kind of this process's own."""

    name: str


class NoWorkers(NamedTuple):
    """Nobody is there who computes; they are waited for."""


ExecutionEvent = ShardDone | EngineFailed | Rescheduled | ProcessorDiffers | NoWorkers

EventCallback = Callable[[ExecutionEvent | None], None]
"""Called, in the thread that executes, for everything that happens; None: nothing for a while."""
