"""`rbstab report`."""

from contextlib import ExitStack, suppress
from itertools import groupby
from pathlib import Path
from threading import Thread
from typing import TYPE_CHECKING

import click

from rbstab_cli import exit_codes
from rbstab_cli.arguments.choice import Choice
from rbstab_cli.arguments.results import results_among, with_folders
from rbstab_cli.output.stored.unread_proofs import print_unread_proofs, results_folder_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rbstab.report.model.document import Report, Unread

FORMATS = ("html", "md", "pdf", "text")

MAX_LISTED = 8
"""The most results that the stored command lists by name; a pattern replaces more, if one fits."""

ENDINGS = {"html": ".html", "md": ".md", "pdf": ".pdf", "text": ".txt"}


@click.command("report")
@click.argument(
    "results", nargs=-1, required=True, metavar="RESULT...", type=click.Path(path_type=Path)
)
@click.option(
    "-o",
    "--output",
    metavar="FILE",
    type=click.Path(path_type=Path),
    help="File of the report; default results/report.html (.md, .pdf by format). With "
    "--format text the default is to print it.",
)
@click.option(
    "--format",
    "form",
    type=Choice(FORMATS),
    help="Format of the report; default: from the ending of FILE, or html without -o.",
)
@click.option("--title", help="Heading of the report; default: from the results.")
@click.option("--force", is_flag=True, help="Replace FILE even if it is not a report.")
@click.option(
    "--json",
    "as_json",
    is_flag=True,
    help="Print the content as JSON; a report only with -o.",
)
@click.option(
    "-q",
    "--quiet",
    is_flag=True,
    help="Do not print the path of the report; problems are still printed.",
)
def command(
    results: tuple[Path, ...],
    output: Path | None,
    form: str | None,
    title: str | None,
    force: bool,
    as_json: bool,
    quiet: bool,
) -> None:
    """Make a report of runs and sweeps.

    Each RESULT is the file of a run, the folder of a sweep, or a folder of results:
    then the runs and sweeps in it are taken, in the order of their names. Proofs, reports, figures
    and notes beside them are left out, so results/* may be named. If a result cannot be read, the
    report gives the reason and shows the others; the exit code is then 4.

    The formats html, md and pdf need the packages of `pip install "rbstab[report]"`.
    """
    from rbstab.report.reading.sources import read_sources
    from rbstab.store.disk.paths import path_is_dir
    from rbstab.store.errors import StoreError
    from rbstab_cli.output.progress import working

    path, form = _target(output, form, as_json=as_json)
    _refuse_inputs(path, results)
    results = results_among(results, quiet=quiet)
    taken = with_folders(results, quiet=quiet)
    _refuse_inputs(path, taken.paths)
    shown = ExitStack()
    try:
        if path is not None:
            # Fail before the work, not after it.
            _check_writable(path, form, force=force)
        shown.enter_context(working("report", wanted=not quiet))
        imports = _import_beside(sweeps=any(map(path_is_dir, taken.paths)))
        sources = read_sources(taken.paths)
        imports.join()
        _print_unread(sources.unread)
        print_unread_proofs(map(results_folder_of, taken.paths))
        made_by = _command(results, output, form, title, force=force, as_json=as_json)

        def write(report: "Report") -> None:
            if path is not None:
                write_report(report, path, form, force=force)
            # Printing ends the progress, which would stand in the way.
            shown.close()
            _print(report, path, as_json=as_json)

        if sources.runs or sources.sweeps:
            from rbstab.report.produce import produce
            from rbstab.report.writers.write import write_report

            tried = form if path is not None else "text"
            known, sources = sources.unread, produce(sources, made_by, title, tried, write)
            _print_unread(sources.unread[len(known) :])
        if not sources.runs and not sources.sweeps:
            click.echo("No result could be read; no report is written.", err=True)
            raise click.exceptions.Exit(exit_codes.STORAGE)
    except StoreError as error:
        click.echo(f"error: {error}", err=True)
        raise click.exceptions.Exit(exit_codes.STORAGE) from error
    finally:
        shown.close()
    if path is not None and not quiet:
        click.echo(f"-> {path}", err=True)
    raise click.exceptions.Exit(exit_codes.STORAGE if sources.unread else exit_codes.OK)


def _import_beside(*, sweeps: bool) -> Thread:
    """Import what makes reports, which takes a second, in a thread; meanwhile workers read results.

    Args:
        sweeps: Whether there are sweeps, whose intervals SciPy computes.
    """

    def work() -> None:
        # Where an import fails, the command repeats it, with its error.
        with suppress(ImportError):
            import rbstab.report.produce  # noqa: F401

            if sweeps:
                import scipy.stats  # noqa: F401

    # The thread is a daemon, so that an interrupt ends the command at once.
    thread = Thread(target=work, daemon=True)
    thread.start()
    return thread


def _print_unread(unread: "Sequence[Unread]") -> None:
    for result in unread:
        click.echo(f"{result.path}: {result.reason}", err=True)


def _check_writable(path: Path, form: str, *, force: bool) -> None:
    """Check that a report of this format can be written to a path.

    Raises:
        UsageError: A package that the format needs is not installed.
        StoreError: As `check_target`.
    """
    from rbstab.report.writers.write import (
        FormatUnavailableError,
        check_available,
        check_target,
    )

    try:
        check_available(form)
    except FormatUnavailableError as error:
        raise click.UsageError(str(error)) from error
    check_target(path, form, force=force)


def _target(output: Path | None, form: str | None, *, as_json: bool) -> tuple[Path | None, str]:
    """Return the file of the report, None for no file, and its format."""
    from rbstab.report.writers.write import SUFFIXES

    if output is None:
        form = form or "html"
        to_stdout = as_json or form == "text"
        return (None if to_stdout else Path("results", f"report{ENDINGS[form]}")), form
    of_name = SUFFIXES.get(output.suffix.lower())
    found = form or of_name
    if form is not None and of_name not in (None, form):
        raise click.UsageError(
            f"-o {output} is the name of a file of the format {of_name}, and --format says {form}"
        )
    if found is None:
        endings = ", ".join(SUFFIXES)
        raise click.UsageError(
            f"the name of {output} does not give the format: expected one of {endings}, or --format"
        )
    return output, found


def _refuse_inputs(path: Path | None, results: tuple[Path, ...]) -> None:
    """Refuse to overwrite a result that the report is made from; an older report is replaced.

    Raises:
        UsageError: The file of the report is one of the results.
    """
    if path is None or not any(_same(path, result) for result in results):
        return
    if not _is_report(path):
        raise click.UsageError(f"{path} is one of the results. Choose another name with -o.")


def _is_report(path: Path) -> bool:
    from rbstab.files.existence import is_file
    from rbstab.report.writers.signature import is_report

    try:
        # Opening a pipe would wait for a writer.
        return is_file(path) and is_report(path)
    except (OSError, ValueError):
        return False


def _same(path: Path, other: Path) -> bool:
    try:
        return path.samefile(other)
    except (OSError, ValueError):
        return False


def _print(report: "Report", path: Path | None, *, as_json: bool) -> None:
    """Print a report as JSON, or as text if it is written to no file."""
    if as_json:
        from rbstab.report.writers.plain_data import data_of
        from rbstab_cli.output.json_output import print_json

        print_json(data_of(report))
    elif path is None:
        from rbstab.report.writers.text import print_report
        from rbstab_cli.output.console import OutputConsole

        # The terminal sets the width; without a terminal it is 80 columns.
        print_report(report, OutputConsole(highlight=False))


def _command(
    results: tuple[Path, ...],
    output: Path | None,
    form: str,
    title: str | None,
    *,
    force: bool,
    as_json: bool,
) -> str:
    """Return the command line that makes the report again."""
    from rbstab.files.shell_words import quoted, shell_word

    words = ["rbstab", "report", *_names(results)]
    words += ["-o", shell_word(output)] if output is not None else []
    words += ["--format", form] if output is not None or not as_json else []
    words += ["--title", quoted(title)] if title is not None else []
    words += ["--force"] if force else []
    words += ["--json"] if as_json else []
    return " ".join(words)


def _names(results: tuple[Path, ...]) -> list[str]:
    """Return the results as words of a command; a pattern may replace all results of a folder."""
    from rbstab.files.shell_words import shell_word

    names: list[str] = []
    for folder, group in groupby(results, key=lambda result: result.parent):
        files = list(group)
        present = sorted(path for path in folder.glob("*.h5") if not path.name.startswith("."))
        if len(files) > MAX_LISTED and files == present:
            names.append("*.h5" if folder == Path() else f"{shell_word(folder)}/*.h5")
        else:
            names += map(shell_word, files)
    return names
