"""How far a sweep is: a bar on a terminal, a line now and then elsewhere."""

import sys
import time
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Event
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from rich.progress import Progress

    from rbstab.sweep.execution.events import SweepEvent

EVERY = 10.0
"""s between two lines where there is no terminal."""


OF_LATE = 30.0
"""s over which the rate is taken."""

SMOOTH = 0.1
"""s between two changes of a bar."""


class ProgressPrinter:
    """Says what happens in a sweep.

    Args:
        interrupted: Set when somebody interrupts.
        quiet: Say only what is wrong.
        bar: Where to draw a bar, or None.
    """

    def __init__(self, interrupted: Event, bar: "Progress | None", *, quiet: bool) -> None:
        self.interrupted = interrupted
        self.quiet = quiet
        self._bar = bar
        self._task: Any = None
        self._said_stopping = False
        self._said_trouble = False
        self._begin = self._last = time.monotonic()
        self._total = 0
        self._rate = Rate()
        self._survey: Any = None

    def __call__(self, event: "SweepEvent | None") -> None:
        """Takes what happened; None where nothing has for a while."""
        from rbstab.sweep.execution.events import (
            Comparing,
            EngineFailed,
            Gathering,
            NoWorkers,
            ProcessorDiffers,
            Rescheduled,
            ShardDone,
            Started,
        )

        if isinstance(event, Started):
            self._start(event)
        elif isinstance(event, ShardDone):
            self._show()
        elif isinstance(event, EngineFailed):
            self._tell_trouble(event)
        elif isinstance(event, Rescheduled):
            self._tell_resent(event)
        elif isinstance(event, ProcessorDiffers):
            self._say(f"warning: some shards come from another kind of processor: {event.name}")
        elif isinstance(event, NoWorkers):
            self._say("warning: the cluster has no workers; they are waited for")
        elif isinstance(event, Comparing):
            text = f"comparing with scipy, {event.done} of {event.members} members"
            self._phase(text, first=event.done == 0)
        elif isinstance(event, Gathering):
            self._phase("gathering", first=True)
        if self.interrupted.is_set() and not self._said_stopping:
            self._said_stopping = True
            self._say("Interrupted: the running shards are finished; once more stops at once.")

    def _start(self, event: Any) -> None:
        self._begin = self._last = time.monotonic()
        self._total = event.members
        self._survey = event.inventory  # which keeps being filled
        self._rate(self._begin, self._done)
        if event.moved_aside is not None:
            self._say(f"the sweep that was there is now {event.moved_aside}")
        if event.changed_versions:
            self._say(
                f"warning: this sweep was begun with others: {', '.join(event.changed_versions)}"
            )
        if self._done and not self.quiet:
            self._say(f"{self._done} of {self._total} members are done already")
        if self._bar is not None:
            self._task = self._bar.add_task("", total=self._total, completed=self._done)

    @property
    def _done(self) -> int:
        return int(self._survey.members)

    def _show(self) -> None:
        now = time.monotonic()
        rate = self._rate(now, self._done)
        if self.quiet or now - self._last < (EVERY if self._bar is None else SMOOTH):
            return
        self._last = now
        if self._bar is not None:
            self._bar.update(self._task, completed=self._done, description=self._facts(rate))
        else:
            counted = f"{self._done} of {self._total} members"
            click.echo(f"{now - self._begin:.0f} s: {counted}, {self._facts(rate)}", err=True)

    def _facts(self, rate: float) -> str:
        """The rate, what did not complete, and the time left."""
        from rbstab.sweep.folder.gather import counts_by_status

        ends = counts_by_status(self._survey.counts)
        others = [f"{count} {status}" for status, count in ends.items() if status != "completed"]
        left = (self._total - self._done) / rate if rate else 0.0
        return ", ".join([f"{rate:.3g}/s", *others, f"{duration(left)} left"])

    def _phase(self, text: str, *, first: bool) -> None:
        now = time.monotonic()
        if self._bar is not None:
            self._bar.update(self._task, completed=self._done, description=text)
        elif not self.quiet and (first or now - self._last >= EVERY):
            self._last = now
            click.echo(f"{now - self._begin:.0f} s: {text}", err=True)

    def _tell_trouble(self, trouble: Any) -> None:
        if not self._said_trouble:
            self._said_trouble = True
            what = f"{type(trouble.error).__name__}: {trouble.error}"
            members = f"members {trouble.start} to {trouble.stop - 1}"
            self._say(
                f"warning: the engine failed at {members} ({what}); "
                "such members are followed one by one"
            )

    def _tell_resent(self, resent: Any) -> None:
        what = str(resent.error) or type(resent.error).__name__
        again = "here" if resent.here else "once more"
        members = f"members {resent.start} to {resent.stop - 1}"
        self._say(f"warning: {members} were lost ({what}); they are computed {again}")

    def _say(self, text: str) -> None:
        if self._bar is not None:
            self._bar.console.print(text, markup=False, highlight=False, soft_wrap=True)
        else:
            click.echo(text, err=True)


class Rate:
    """How many members a second there have been of late: slow ones may follow fast ones."""

    def __init__(self) -> None:
        self._seen: deque[tuple[float, int]] = deque()

    def __call__(self, now: float, done: int) -> float:
        """The rate at an instant (s) at which so many are done; 0 at the first one."""
        self._seen.append((now, done))
        while len(self._seen) > 2 and self._seen[1][0] <= now - OF_LATE:
            self._seen.popleft()
        before, done_before = self._seen[0]
        return (done - done_before) / (now - before) if now > before else 0.0


@contextmanager
def progress_printer(interrupted: Event, *, quiet: bool) -> Iterator[ProgressPrinter]:
    """A teller, with a bar on stderr where that is a terminal."""
    if quiet or not sys.stderr.isatty():
        yield ProgressPrinter(interrupted, None, quiet=quiet)
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (
        TextColumn("{task.completed} of {task.total} members"),
        BarColumn(),
        TextColumn("{task.description}", markup=False),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        yield ProgressPrinter(interrupted, bar, quiet=quiet)


def duration(seconds: float) -> str:
    """A time in words: 40 s, 12 min, 3.5 h."""
    if seconds < 100:
        return f"{seconds:.2g} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.3g} h"
