"""Sweeps with made up members, and recorders of their events."""

import hashlib
import threading

from rbstab.sweep.execution.events import ShardDone
from rbstab.sweep.folder.sweep_table import read_sweep
from rbstab.sweep.options import SweepOptions
from rbstab.sweep.sweep import sweep_to_folder
from support.sweeps import FakeEngine, plan_of


class EventRecorder:
    """Records the events of a sweep, and calls `act` at the `count`-th event of a kind."""

    def __init__(self, kind=ShardDone, count=0, act=lambda: None):
        self.events = []
        self.kind, self.count, self.act = kind, count, act

    def __call__(self, event):
        if event is None:
            return
        self.events.append(event)
        if isinstance(event, self.kind) and len(self.of(self.kind)) == self.count:
            self.act()

    def of(self, kind):
        """Return the recorded events of a kind."""
        return [event for event in self.events if isinstance(event, kind)]


class Listener(EventRecorder):
    """An event recorder that stops the sweep after a number of shards, if one is given."""

    def __init__(self, shards=0):
        self.stop = threading.Event()
        super().__init__(ShardDone, shards, self.stop.set)

    @property
    def computed(self):
        """The numbers of the computed shards."""
        return sorted(event.number for event in self.of(ShardDone))


HARMS = ("flip", "cut", "empty", "swap", "seal", "longer")


def harmed(content, other, harm):
    """Return what is left of the content of a file; `other` is that of another file."""

    def flipped(at):
        return content[:at] + bytes([content[at] ^ 1]) + content[at:][1:]

    return {
        "flip": flipped(len(content) - 500),
        "cut": content[:-100],
        "empty": b"",
        "swap": other,
        "seal": flipped(len(content) - 10),
        "longer": content[:50] + b"0" + content[50:],
    }[harm]


def run_sweep(path, plan=None, listener=None, factory=FakeEngine, **changes):
    """Run a sweep with a fake engine.

    The plan states the engine scipy, so no member is compared with SciPy afterwards.
    """
    listener = listener or Listener()
    options = SweepOptions(**{"factory": factory, "shard_size": 10, "threads": 2, **changes})
    return sweep_to_folder(plan or plan_of(), path, options, listener, listener.stop)


def digest_of(path):
    """Return a digest of all columns of a finished sweep, however its shards are cut."""
    table = read_sweep(path)
    content = [(name, table[name].tobytes()) for name in sorted(["run", *table.columns])]
    return hashlib.sha256(repr(content).encode()).hexdigest()
