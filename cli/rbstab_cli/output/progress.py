"""Progress of long work on stderr: a bar on a terminal, elsewhere a line every ten seconds."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Event, Thread
from typing import TYPE_CHECKING

from rbstab_cli.printing import is_quiet, say

if TYPE_CHECKING:
    from rich.progress import Progress as Bar

LINE_INTERVAL = 10.0
"""Time between two lines, s. Work that is done sooner prints none."""


class Work:
    """Work in progress.

    Args:
        name: What is done.
        bar: The bar on a terminal, or None.
    """

    def __init__(self, name: str, bar: "Bar | None" = None) -> None:
        self.name, self.status = name, ""
        self.begin, self._bar = time.monotonic(), bar
        self._task = None if bar is None else bar.add_task(name, total=None, status="")

    def update(self, status: str, fraction: float | None = None) -> None:
        """Say how far the work is.

        Args:
            status: In words.
            fraction: What is done of the whole; None if the end is not known.
        """
        self.status = status
        if self._bar is not None and self._task is not None:
            total = None if fraction is None else 1.0
            self._bar.update(self._task, completed=fraction or 0.0, total=total, status=status)

    def count(self, done: int, total: int) -> None:
        """Say how many of many things are done."""
        self.update(f"{done} of {total}", done / max(total, 1))

    def simulated(self, duration: float) -> Callable[[float], None]:
        """Return the callback of a run, which says the simulated time after every step.

        Args:
            duration: The time at its end, s.
        """
        return lambda t: self.update(f"t = {t:.3g} of {duration:g} s", t / duration)

    def print(self, text: str) -> None:
        """Print a line that stays, above the bar if there is one."""
        if self._bar is not None:
            self._bar.console.print(text, markup=False, highlight=False, soft_wrap=True)
        else:
            say(text)

    def hint(self, text: str) -> None:
        """Print a line that stays, and that --quiet leaves out."""
        if not is_quiet():
            self.print(text)

    @property
    def line(self) -> str:
        """The time since the beginning, what is done, and how far it is."""
        seconds = f"{time.monotonic() - self.begin:.0f} s"
        return f"{seconds}: {self.name}{', ' if self.status else ''}{self.status}"


@contextmanager
def working(name: str) -> Iterator[Work]:
    """Show on stderr that something is at work, and how far it is; nothing with --quiet.

    Args:
        name: What it is.
    """
    if is_quiet():
        yield Work(name)
    elif sys.stderr.isatty():
        with _bar() as bar:
            yield Work(name, bar)
    else:
        work = Work(name)
        with _lines(work):
            yield work


def _bar() -> "Bar":
    # Imported late: it takes a while, and is of use on a terminal only.
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    from rbstab_cli.console import OutputConsole

    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TextColumn("{task.fields[status]}", markup=False),
        TimeElapsedColumn(),
    )
    console = OutputConsole(stderr=True)
    return Progress(*columns, console=console, transient=True, redirect_stdout=False)


@contextmanager
def _lines(work: Work) -> Iterator[None]:
    """Print the line of some work every ten seconds, also while it says nothing itself."""
    done = Event()

    def print_lines() -> None:
        while not done.wait(LINE_INTERVAL):
            try:
                say(work.line)
            except (OSError, ValueError):
                return  # stderr is closed; the command itself finds that out

    # The thread is a daemon, so that an interrupt ends the command at once.
    thread = Thread(target=print_lines, daemon=True)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()


MANY_ELEMENTS = 8
"""Compiling the equations of so many elements is announced: it takes more than ten seconds."""


def compiling(engine: str, elements: int) -> str:
    """Return what is said while equations are compiled; empty if that takes a few seconds.

    Args:
        engine: The name of the engine.
        elements: The number of elements of the system.
    """
    if engine != "heyoka" or elements < MANY_ELEMENTS:
        return ""
    return f"compiling the equations of {elements} elements (may take a minute, once)"
