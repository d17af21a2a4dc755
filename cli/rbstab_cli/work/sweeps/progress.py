"""Progress of a sweep: what its events say, and how far it is."""

import time
from threading import Event
from typing import Any

from rbstab.files.counts import grouped
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
        quiet: Print only problems.
    """

    def __init__(self, interrupted: Event, work: Work, *, quiet: bool) -> None:
        self.interrupted = interrupted
        self.quiet = quiet
        self._work = work
        self._printed_stopping = False
        self._last = 0.0
        self._total = 0
        self._begun = 0.0, 0
        self._inventory: Any = None
        self._proves = False

    def __call__(self, event: SweepEvent | None) -> None:
        """Print an event; with None (no event for a while) only report an interrupt."""
        if isinstance(event, Started):
            self._start(event)
        elif isinstance(event, ShardDone):
            self._update()
        elif isinstance(event, Warned):
            self._work.print(f"warning: {event.text}")
        elif isinstance(event, Comparing):
            text = f"comparing with scipy, {event.done} of {event.members} members"
            self._work.update(text, event.done / event.members)
        elif isinstance(event, Finishing):
            self._work.update("finishing")
        if self.interrupted.is_set() and not self._printed_stopping:
            self._printed_stopping = True
            self._work.print(
                "Interrupted: finishing the running shards. Press Ctrl-C again to stop at once."
            )

    def _start(self, event: Started) -> None:
        self._total = event.members
        self._proves = "motion_proof" in event.folder.manifest.columns
        self._inventory = event.inventory  # the sweep keeps adding shards to it
        done = self._inventory.members
        self._begun = time.monotonic(), done
        if event.moved_aside is not None:
            self._work.print(f"the previous sweep was moved to {event.moved_aside}")
        if event.changed:
            versions = ", ".join(event.changed)
            self._work.print(f"warning: this sweep was started with other versions: {versions}")
        if done and not self.quiet:
            self._work.print(f"{self._of_all(done)} members are already done")

    def _of_all(self, count: int) -> str:
        return f"{grouped(count)} of {grouped(self._total)}"

    def _update(self) -> None:
        now, done = time.monotonic(), self._inventory.members
        if now - self._last >= UPDATE_INTERVAL:
            self._last = now
            begin, before = self._begun
            rate = (done - before) / max(now - begin, 1e-9)
            facts = f"{self._of_all(done)} members, {self._facts(rate, done)}"
            self._work.update(facts, done / self._total)

    def _facts(self, rate: float, done: int) -> str:
        """Return a text: the rate, counts of statuses except `completed`, and the time left.

        If the plan has `prove`, it begins with the number of proved members.
        """
        by_status = counts_by_status(self._inventory.counts)
        by_status.pop(RunStatus.COMPLETED, None)
        others = [f"{grouped(count)} {status}" for status, count in by_status.items()]
        left = (self._total - done) / rate if rate else 0.0
        speed = [f"{rate:.3g}/s"]
        if self._proves:
            proved = f"{self._of_all(self._inventory.proved)} members proved"
            speed = [proved, f"{rate:.3g} members/s"]
        return ", ".join([*speed, *others, f"{duration(left)} left"])


def duration(seconds: float) -> str:
    """Return a time with its unit: 40 s, 12 min, 3.5 h."""
    if seconds < 100:
        return f"{seconds:.2g} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.3g} h"
