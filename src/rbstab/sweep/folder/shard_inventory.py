"""Inventory of the shards of a sweep: which are stored, and which are missing."""

from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.store.errors import NotAResultError
from rbstab.store.table import Table
from rbstab.store.variables import RUN
from rbstab.sweep.folder.sweep_folder import SweepFolder
from rbstab.sweep.members.engine import FAILED_CODES
from rbstab.sweep.members.outcome import STATUSES


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

    @classmethod
    def of(cls, shard: Table) -> "ShardFacts":
        """Return the facts of a shard."""
        status = shard["status"]
        failed = shard[RUN][np.isin(status, FAILED_CODES)].tolist()
        proved = shard["proved_rest_state"] if "proved_rest_state" in shard else np.zeros(0)
        counts = np.bincount(status, minlength=len(STATUSES))
        return cls(counts, min(failed, default=None), shard.digest, int((proved > 0).sum()))


@dataclass
class ShardInventory:
    """Which shards of a sweep are stored.

    Attributes:
        done: The facts of the stored shards, by number.
        missing: The numbers of the missing shards, ascending. A damaged shard is missing, too.
        damaged: The numbers of the shards that have a file, but a damaged one.
    """

    done: dict[int, ShardFacts] = field(default_factory=dict)
    missing: list[int] = field(default_factory=list)
    damaged: list[int] = field(default_factory=list)

    @property
    def counts(self) -> Array:
        """The number of members with each status, indexed by the code of the status."""
        zeros = np.zeros(len(STATUSES), dtype=np.int64)
        return zeros + sum(facts.counts for facts in self.done.values())

    @property
    def members(self) -> int:
        """The number of members in the stored shards."""
        return int(self.counts.sum())

    @property
    def proved(self) -> int:
        """The number of members whose convergence is proved, if the plan has `prove`."""
        return sum(facts.proved for facts in self.done.values())

    @property
    def first_failed(self) -> int | None:
        """The first failed member of the stored shards; None if no member failed."""
        failed = [f.first_failed for f in self.done.values() if f.first_failed is not None]
        return min(failed, default=None)


def shard_inventory(
    folder: SweepFolder, numbers: Iterable[int] | None = None, *, read_traces: bool = False
) -> ShardInventory:
    """Read and verify the shards of a sweep, and return the inventory.

    Args:
        folder: The folder.
        numbers: The shards to look for; default all.
        read_traces: Whether to read the files of traces too. A shard with damaged traces is then
            missing. Otherwise only the seals of these files are compared, which is much faster.

    Raises:
        StoreError: A shard cannot be read.
    """
    inventory = ShardInventory()
    stored = folder.stored_shards()
    for number in range(folder.shards) if numbers is None else numbers:
        if number in stored:
            with suppress(NotAResultError):
                shard = folder.read(number)
                if folder.has_whole_traces(number, shard, read=read_traces):
                    inventory.done[number] = ShardFacts.of(shard)
                    continue
            inventory.damaged.append(number)
        inventory.missing.append(number)
    return inventory
