"""Inventory of the shards of a sweep: which are stored, and which are missing."""

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.sweep.folder.sweep_folder import ShardFacts, SweepFolder
from rbstab.sweep.members.outcome import STATUSES


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
        found = np.zeros(len(STATUSES), dtype=np.int64)
        return found + sum(facts.counts for facts in self.done.values())

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
        found = [f.first_failed for f in self.done.values() if f.first_failed is not None]
        return min(found, default=None)

    def counting_failed_as_missing(self) -> "ShardInventory":
        """Return an inventory in which each shard with a failed member counts as missing."""
        failed = [k for k, facts in self.done.items() if facts.first_failed is not None]
        done = {k: facts for k, facts in self.done.items() if k not in failed}
        return ShardInventory(done, sorted([*self.missing, *failed]))

    def add_from(self, other: "ShardInventory") -> None:
        """Add the stored shards of another inventory that are missing in this one."""
        self.done = other.done | self.done
        self.missing = [k for k in self.missing if k not in self.done]


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
        facts = folder.facts(number, read_traces=read_traces) if number in stored else None
        if facts is not None:
            inventory.done[number] = facts
            continue
        inventory.missing.append(number)
        if number in stored:
            inventory.damaged.append(number)
    return inventory
