"""Sweeps of made up motions, and whoever listens to them."""

import threading

from rbstab.store.table_file import read_table
from rbstab.sweep.execution.events import ShardDone
from rbstab.sweep.options import SweepOptions
from rbstab.sweep.sweep import sweep_to_folder
from support.sweeps import FakeEngine, plan_of


class Listener:
    """Keeps what happens, and stops the sweep after some shards."""

    def __init__(self, shards=None):
        self.events = []
        self.stop = threading.Event()
        self.shards = shards

    def __call__(self, event):
        if event is not None:
            self.events.append(event)
        if self.shards is not None and len(self.of(ShardDone)) >= self.shards:
            self.stop.set()

    def of(self, kind):
        return [event for event in self.events if isinstance(event, kind)]

    @property
    def computed(self):
        return sorted(event.number for event in self.of(ShardDone))


def swept(path, plan=None, listener=None, factory=FakeEngine, **options):
    """Sweeps a plan whose engine is scipy by name, so that nothing is repeated as a single run."""
    listener = listener or Listener()
    options = SweepOptions(**{"factory": factory, "shard_size": 10, "threads": 2, **options})
    return sweep_to_folder(plan or plan_of(), path, options, listener, listener.stop)


def digest_of(path):
    return read_table(path / "sweep.h5").attributes["arrays_digest"]
