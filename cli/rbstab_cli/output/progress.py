"""Progress of long work on stderr: a bar on a terminal, elsewhere a line every ten seconds."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Event, Thread
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from rich.progress import Progress as Bar

    from rbstab.integrate.problem import Progress
    from rbstab.proof.check.findings import Finding

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
        self._begin, self._bar = time.monotonic(), bar
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

    def print(self, text: str) -> None:
        """Print a line that stays, above the bar if there is one."""
        if self._bar is not None:
            self._bar.console.print(text, markup=False, highlight=False, soft_wrap=True)
        else:
            click.echo(text, err=True)

    @property
    def line(self) -> str:
        """The time since the beginning, what is done, and how far it is."""
        seconds = f"{time.monotonic() - self._begin:.0f} s"
        return f"{seconds}: {self.name}{', ' if self.status else ''}{self.status}"


@contextmanager
def working(name: str, *, wanted: bool) -> Iterator[Work]:
    """Show on stderr that something is at work, and how far it is.

    Args:
        name: What it is.
        wanted: Whether to show it.
    """
    if not wanted:
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

    from rbstab_cli.output.console import OutputConsole

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
                click.echo(work.line, err=True)
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


@contextmanager
def starts_proved(name: str, *, wanted: bool) -> Iterator[Callable[[float, int], None]]:
    """Show the fraction of the starts that is proved; the callback gets it, and the parts left.

    A line at the beginning says how much work there may be, and how to stop it.
    """
    from rbstab.experiment.start_sets.starts_record import MAX_PARTS

    with working(name, wanted=wanted) as work:
        if wanted and sys.stderr.isatty():
            work.print(
                f"All starts, in at most {MAX_PARTS} parts of up to a minute each; smaller "
                "tolerances need fewer. Ctrl-C stops, and then nothing is stored."
            )
        yield lambda fraction, left: work.update(
            f"{100 * fraction:.4g} % proved, {left} parts left", fraction
        )


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


@contextmanager
def simulated_time(
    name: str, duration: float, *, wanted: bool, before: str = ""
) -> "Iterator[Progress]":
    """Show the simulated time of a run, which calls the callback after every step.

    Args:
        name: The run.
        duration: The time at its end, s.
        before: What is done before the first step, if it takes long (`compiling`).
        wanted: Whether to show it.
    """
    with working(name, wanted=wanted) as work:
        work.update(before)
        yield lambda t: work.update(f"t = {t:.3g} of {duration:g} s", t / duration)


@contextmanager
def claims_checked(name: str, *, wanted: bool) -> "Iterator[Callable[[Finding], None]]":
    """Show how many claims of a proof are checked; the callback gets each finding."""
    count = 0

    def checked(finding: "Finding") -> None:
        nonlocal count
        count += 1
        work.update(f"{count} claims checked, last: {finding.claim}")

    with working(name, wanted=wanted) as work:
        yield checked


@contextmanager
def counting(name: str, *, wanted: bool) -> Iterator[Callable[[int, int], None]]:
    """Show how many of many things are done; the callback gets this number, and that of all."""
    with working(name, wanted=wanted) as work:
        yield lambda done, total: work.update(f"{done} of {total}", done / max(total, 1))
