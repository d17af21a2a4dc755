"""Progress of a run: a bar on a terminal, nothing elsewhere."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rbstab.analysis.proof_check.findings import Finding
    from rbstab.integrate.problem import Progress


@contextmanager
def fraction_bar(name: str, *, wanted: bool) -> "Iterator[Callable[[float, int], None] | None]":
    """Show a bar on stderr with the fraction of the starts that is proved.

    A line above it says how much work there may be, and how to stop it.

    Args:
        name: The label of the bar.
        wanted: Whether to show the bar if stderr is a terminal.

    Yields:
        The callback, with the fraction and the number of parts that are left; None if there is no
        bar.
    """
    if not (wanted and sys.stderr.isatty()):
        yield None
        return
    from rich.console import Group
    from rich.live import Live
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
    from rich.text import Text

    from rbstab.experiment.start_sets.prove_starts import MAX_PARTS
    from rbstab_cli.output.console import OutputConsole

    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TextColumn("{task.percentage:.4g} % proved, {task.fields[left]} parts left"),
        TimeElapsedColumn(),
    )
    hint = Text(
        f"All starts, in at most {MAX_PARTS} parts of up to a minute each; smaller tolerances need "
        "fewer. Ctrl-C stops, and then nothing is stored."
    )
    progress = Progress(*columns)
    with Live(Group(hint, progress), console=OutputConsole(stderr=True), transient=True):
        task = progress.add_task(name, total=1.0, left=1)
        yield lambda fraction, left: progress.update(task, completed=fraction, left=left)


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
def progress_bar(
    name: str, duration: float, *, wanted: bool, before: str = ""
) -> "Iterator[Progress | None]":
    """Show a bar on stderr with the simulated time of one run.

    Args:
        name: The label of the bar.
        duration: The time at the end of the run, s.
        before: What is done before the first step, if it takes long (`compiling`).
        wanted: Whether to show the bar if stderr is a terminal.

    Yields:
        The callback that the run calls after every step, or None if there is no bar.
    """
    if not (wanted and sys.stderr.isatty()):
        yield None
        return
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    from rbstab_cli.output.console import OutputConsole

    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TextColumn("t = {task.completed:.3g} of {task.total:g} s"),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=OutputConsole(stderr=True), transient=True) as progress:
        task = progress.add_task(f"{name}: {before}" if before else name, total=duration)
        yield lambda t: progress.update(task, completed=t, description=name)


@contextmanager
def claims_checked(name: str, *, wanted: bool) -> "Iterator[Callable[[Finding], None]]":
    """Show on stderr how many claims of a proof are checked.

    Args:
        name: The name of the proof.
        wanted: Whether to show it if stderr is a terminal.

    Yields:
        The callback, with each finding.
    """
    if not (wanted and sys.stderr.isatty()):
        yield lambda _: None
        return
    from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    from rbstab_cli.output.console import OutputConsole

    columns = (
        SpinnerColumn(),
        TextColumn("{task.description}", markup=False),
        TextColumn("{task.completed:g} claims checked{task.fields[last]}", markup=False),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=OutputConsole(stderr=True), transient=True) as progress:
        task = progress.add_task(name, total=None, last="")
        yield lambda finding: progress.update(task, advance=1, last=f", last: {finding.claim}")


@contextmanager
def working(name: str, *, wanted: bool) -> "Iterator[None]":
    """Show on stderr that something whose end is not known is at work.

    Args:
        name: What it is.
        wanted: Whether to show it if stderr is a terminal.
    """
    if not (wanted and sys.stderr.isatty()):
        yield
        return
    from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    from rbstab_cli.output.console import OutputConsole

    columns = (
        SpinnerColumn(),
        TextColumn("{task.description}", markup=False),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=OutputConsole(stderr=True), transient=True) as progress:
        progress.add_task(name, total=None)
        yield


@contextmanager
def counting(name: str, *, wanted: bool) -> "Iterator[Callable[[int, int], None]]":
    """Show on stderr how many of many things are done.

    Args:
        name: What they are.
        wanted: Whether to show it if stderr is a terminal.

    Yields:
        The callback for the number of those that are done, and of all.
    """
    if not (wanted and sys.stderr.isatty()):
        yield lambda _done, _all: None
        return
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    from rbstab_cli.output.console import OutputConsole

    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=OutputConsole(stderr=True), transient=True) as progress:
        task = progress.add_task(name)
        yield lambda done, total: progress.update(task, completed=done, total=total)
