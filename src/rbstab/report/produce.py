"""Build and write a report, even if the content of some results raises errors."""

from collections.abc import Callable
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory

from rich.console import Console

from rbstab.report.build import report_of
from rbstab.report.model.document import Report, Unread
from rbstab.report.model.words import untrusted
from rbstab.report.reading.sources import Run, Sources, SweepFile
from rbstab.report.writers.plain_data import data_of
from rbstab.report.writers.text import print_report
from rbstab.report.writers.write import FormatUnavailableError, write_report
from rbstab.store.errors import ResultExistsError


def produce(
    sources: Sources,
    command: str,
    title: str | None,
    form: str,
    write: Callable[[Report], None],
) -> Sources:
    """Build a report and write it.

    The content of a result may be damaged in a way that no check foresees. If building or writing
    raises an error, each result is tried alone. Those that fail are listed as unread.

    Args:
        sources: The results.
        command: The command that repeats the report.
        title: The heading; default: from the results.
        form: The format; "text" if the report is only printed.
        write: Writes the report in this format, as JSON, or both.

    Returns:
        The sources, with the results that failed among the unread ones. If all failed, there is no
        report.

    Raises:
        StoreError: The report cannot be written.
    """
    try:
        report = report_of(sources, command, title)
        if form == "text":
            # What is printed cannot be taken back, so errors must come before.
            _rehearse(report, form)
        data_of(report)
        write(report)
    except Exception as error:
        usable = _usable(sources, command, form)
        if _is_of_the_system(error) or usable == sources:
            raise
    else:
        return sources
    if usable.runs or usable.sweeps:
        write(report_of(usable, command, title))
    return usable


def _usable(sources: Sources, command: str, form: str) -> Sources:
    """Return the sources in which the results that fail alone are unread."""
    results: list[Run | SweepFile | Unread] = [*sources.unread]
    every: list[Run | SweepFile] = [*sources.runs, *sources.sweeps]
    for result in every:
        try:
            _rehearse(report_of(Sources.of([result]), command), form)
        except Exception as error:
            if _is_of_the_system(error):
                raise
            reason = f"its content cannot be shown ({type(error).__name__}: {error})"
            results.append(Unread(untrusted(result.path), untrusted(reason)))
        else:
            results.append(result)
    return Sources.of(results)


def _rehearse(report: Report, form: str) -> None:
    """Make a report and discard it."""
    data_of(report)
    if form == "text":
        print_report(report, Console(file=StringIO()))
        return
    with TemporaryDirectory() as folder:
        write_report(report, Path(folder, "report"), form)


def _is_of_the_system(error: Exception) -> bool:
    """Whether the system raised an error, and not the content of a result."""
    of_system = OSError | ResultExistsError | FormatUnavailableError
    return isinstance(error, of_system) or isinstance(error.__cause__, OSError)
