"""Progress of a sweep: what its events say, and how far it is."""

import time
from threading import Event

from rbstab.files.text import grouped
from rbstab.integrate.status import RunStatus
from rbstab.sweep.execution.events import (
    Comparing,
    Finishing,
    ShardDone,
    Started,
    SweepEvent,
    Warned,
)
from rbstab.sweep.folder.members_file import counts_by_status
from rbstab_cli.output.progress import Work

UPDATE_INTERVAL = 0.1
"""Time between two updates, s."""


class EventPrinter:
    """Callback that prints the events of a sweep.

    Args:
        interrupted: Set when the user interrupts the sweep.
        work: Shows how far the sweep is.
    """

    def __init__(self, interrupted: Event, work: Work) -> None:
        self.interrupted, self._work = interrupted, work
        self._told_interrupt = False
        self._last = 0.0

    def __call__(self, event: SweepEvent | None) -> None:
        """Print an event; with None (no event for a while) only report an interrupt."""
        match event:
            case Started():
                self._start(event)
            case ShardDone() if time.monotonic() - self._last >= UPDATE_INTERVAL:
                self._last = time.monotonic()
                self._update()
            case Warned():
                self._work.print(f"warning: {event.text}")
            case Comparing():
                text = f"comparing with scipy, {event.done} of {event.members} members"
                self._work.update(text, event.done / event.members)
            case Finishing():
                self._work.update("finishing")
        if self.interrupted.is_set() and not self._told_interrupt:
            self._told_interrupt = True
            self._work.print(
                "Interrupted: finishing the running shards. Press Ctrl-C again to stop at once."
            )

    def _start(self, event: Started) -> None:
        # The sweep keeps adding shards to the inventory.
        self._total, self._inventory = event.members, event.inventory
        self._proves = "motion_proof" in event.folder.manifest.columns
        done = self._inventory.members
        self._begun = time.monotonic(), done
        if event.moved_aside is not None:
            self._work.print(f"the previous sweep was moved to {event.moved_aside}")
        if event.changed:
            versions = ", ".join(event.changed)
            self._work.print(f"warning: this sweep was started with other versions: {versions}")
        if done:
            self._work.hint(f"{self._of_all(done)} members are already done")

    def _of_all(self, count: int) -> str:
        return f"{grouped(count)} of {grouped(self._total)}"

    def _update(self) -> None:
        """Say how many members are done, and proved, and the rate, failures and the time left."""
        (begin, before), done = self._begun, self._inventory.members
        rate = (done - before) / max(time.monotonic() - begin, 1e-9)
        facts = [f"{self._of_all(done)} members", f"{rate:.3g}/s"]
        if self._proves:
            proved = f"{self._of_all(self._inventory.proved)} members proved"
            facts[1:] = [proved, f"{rate:.3g} members/s"]
        by_status = counts_by_status(self._inventory.counts)
        by_status.pop(RunStatus.COMPLETED, None)
        facts += [f"{grouped(count)} {status}" for status, count in by_status.items()]
        facts.append(f"{duration((self._total - done) / rate if rate else 0.0)} left")
        self._work.update(", ".join(facts), done / self._total)


def duration(seconds: float) -> str:
    """Return a time with its unit: 40 s, 12 min, 3.5 h."""
    if seconds < 100:
        return f"{seconds:.2g} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.3g} h"
