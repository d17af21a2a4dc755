"""`rbstab report`: a report of runs and sweeps, as a file, as JSON or printed."""

from collections.abc import Iterable, Sequence
from contextlib import ExitStack
from os.path import realpath
from pathlib import Path

import click

from rbstab.files.text import quoted
from rbstab.report.model.document import Report, Unread
from rbstab.report.reading.sources import read_sources
from rbstab.report.writers.plain_data import data_of
from rbstab.report.writers.write import SUFFIXES, check_available, write_report
from rbstab.report.writers.write import check_target as check_report
from rbstab_cli import exit_codes
from rbstab_cli.command import TYPED
from rbstab_cli.errors import Failed
from rbstab_cli.output.progress import working
from rbstab_cli.output.runs import print_unread_proofs
from rbstab_cli.printing import hint, print_json, say
from rbstab_cli.results import results_folder_of, taken


def report(
    results: tuple[Path, ...],
    output: Path | None,
    form: str | None,
    title: str | None,
    force: bool,
    opened: bool,
    as_json: bool,
) -> int:
    """Make the report, and say where it is."""
    path, form = _target(output, form, as_json=as_json)
    if opened and path is None:
        raise click.UsageError("--open needs a file of the report: give -o FILE")
    paths = taken(results).paths
    if path is not None:
        _check_writable(path, form, paths, force=force)
    with ExitStack() as shown:
        shown.enter_context(working("report"))
        sources = read_sources(paths)
        _print_unread(sources.unread)
        print_unread_proofs(map(results_folder_of, paths))
        words = click.get_current_context().meta[TYPED]
        made_by = f"rbstab report {' '.join(map(quoted, words))}".rstrip()

        def write(made: Report) -> None:
            if path is not None:
                write_report(made, path, form, force=force)
            # Printing ends the progress, which would stand in the way.
            shown.close()
            _print(made, path, as_json=as_json)

        if sources.runs or sources.sweeps:
            # Imported late: it takes a second.
            from rbstab.report.produce import produce

            tried = form if path is not None else "text"
            unread, sources = sources.unread, produce(sources, made_by, title, tried, write)
            _print_unread(sources.unread[len(unread) :])
    if not sources.runs and not sources.sweeps:
        raise Failed(exit_codes.STORAGE, "No result could be read; no report is written.")
    if path is not None:
        hint(f"-> {path}")
    if opened and path is not None:
        click.launch(path.absolute().as_uri())
    return exit_codes.STORAGE if sources.unread else exit_codes.OK


def _print_unread(unread: Iterable[Unread]) -> None:
    for result in unread:
        say(f"{result.path}: {result.reason}")


def _target(output: Path | None, form: str | None, *, as_json: bool) -> tuple[Path | None, str]:
    """Return the file of the report, None for no file, and its format."""
    if output is None:
        form = form or "html"
        to_stdout = as_json or form == "text"
        ending = next(suffix for suffix, name in SUFFIXES.items() if name == form)
        return (None if to_stdout else Path("results", f"report{ending}")), form
    of_name = SUFFIXES.get(output.suffix.lower())
    chosen = form or of_name
    if form is not None and of_name not in (None, form):
        raise click.UsageError(
            f"-o {output} is the name of a file of the format {of_name}, and --format says {form}"
        )
    if chosen is None:
        endings = ", ".join(SUFFIXES)
        raise click.UsageError(
            f"the name of {output} does not give the format: expected one of {endings}, or --format"
        )
    return output, chosen


def _check_writable(path: Path, form: str, results: Sequence[Path], *, force: bool) -> None:
    """Check before the work that a report can be written; an older report is replaced."""
    if realpath(path) in map(realpath, results):
        raise click.UsageError(f"{path} is one of the results. Choose another name with -o.")
    check_available(form)
    check_report(path, form, force=force)


def _print(made: Report, path: Path | None, *, as_json: bool) -> None:
    """Print a report as JSON, or as text if it is written to no file."""
    if as_json:
        print_json(data_of(made))
    elif path is None:
        from rbstab.report.writers.text import print_report
        from rbstab_cli.console import OutputConsole

        # The terminal sets the width; without a terminal it is 80 columns.
        print_report(made, OutputConsole(highlight=False))
