"""How far a run is: a bar on a terminal, nothing elsewhere (finished runs have their own lines)."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rbstab.integrate.problem import Progress


@contextmanager
def bar(name: str, duration: float, *, wanted: bool) -> "Iterator[Progress | None]":
    """A bar on stderr that follows the time of one run.

    Args:
        name: What is run.
        duration: The time at its end, s.
        wanted: Whether to show one at all.

    Yields:
        What the run calls after every step, or None where no bar is shown.
    """
    if not (wanted and sys.stderr.isatty()):
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TextColumn("t = {task.completed:.3g} of {task.total:g} s"),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task(name, total=duration)
        yield lambda t: progress.update(task, completed=t)
