"""Inventory of the shards of a sweep: which are stored, and which are missing."""

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.sweep.folder.sweep_folder import ShardFacts, SweepFolder
from rbstab.sweep.members.outcome import STATUSES


@dataclass
class ShardInventory:
    """The facts of the stored shards of a sweep by number, and the numbers of the missing ones."""

    done: dict[int, ShardFacts] = field(default_factory=dict)
    missing: list[int] = field(default_factory=list)

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


def shard_inventory(folder: SweepFolder, numbers: Iterable[int] | None = None) -> ShardInventory:
    """Read and verify the shards of a sweep, and return the inventory.

    Args:
        folder: The folder.
        numbers: The shards to look for; default all.

    Raises:
        StoreError: A shard cannot be read.
    """
    inventory = ShardInventory()
    for number in range(folder.shards) if numbers is None else numbers:
        facts = folder.facts(number)
        if facts is None:
            inventory.missing.append(number)
        else:
            inventory.done[number] = facts
    return inventory
