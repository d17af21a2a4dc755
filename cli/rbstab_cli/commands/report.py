"""`rbstab report`."""

import shlex
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING

import click

from rbstab_cli import exit_codes

if TYPE_CHECKING:
    from rbstab.report.model.document import Report

FORMATS = ("html", "md", "pdf", "text")

MANY = 8
"""Results whose names are written out in a command."""

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
    help="The report; default results/report.html, or by the format. Text goes to stdout.",
)
@click.option(
    "--format",
    "form",
    type=click.Choice(FORMATS),
    help="Default: by the name of FILE; html without one.",
)
@click.option("--title", help="Heading of the report.")
@click.option("--force", is_flag=True, help="Replace FILE even if it is no report.")
@click.option(
    "--json", "as_json", is_flag=True, help="Print what it says as JSON; no report without -o."
)
@click.option("-q", "--quiet", is_flag=True, help="No word on where it is; errors are still said.")
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

    Each RESULT is the file of a run, the folder of a sweep, or its sweep.h5. A result that cannot
    be read is named in the report with the reason, and the others are reported; the exit code is
    then 4.
    """
    from rbstab.report.build import report_of
    from rbstab.report.reading.sources import read_sources
    from rbstab.store.errors import StoreError

    path, form = _target(output, form, as_json=as_json)
    _refuse_inputs(path, results)
    try:
        if path is not None:
            from rbstab.report.writers.write import check_replaceable

            # Before the work, not after it.
            check_replaceable(path, force=force)
        sources = read_sources(results)
        for unread in sources.unread:
            click.echo(f"{unread.path}: {unread.reason}", err=True)
        if not sources.runs and not sources.sweeps:
            click.echo("Nothing could be read; there is no report.", err=True)
            raise click.exceptions.Exit(exit_codes.STORAGE)
        made_by = _command(results, output, form, title, force=force, as_json=as_json)
        report = report_of(sources, made_by, title)
        _put(report, path, form, force=force, as_json=as_json)
    except StoreError as error:
        click.echo(f"error: {error}", err=True)
        raise click.exceptions.Exit(exit_codes.STORAGE) from error
    if path is not None and not quiet:
        click.echo(f"-> {path}", err=True)
    raise click.exceptions.Exit(exit_codes.STORAGE if sources.unread else exit_codes.OK)


def _target(output: Path | None, form: str | None, *, as_json: bool) -> tuple[Path | None, str]:
    """Where the report goes, None for nowhere or stdout, and its format."""
    from rbstab.report.writers.write import SUFFIXES

    if output is None:
        form = form or "html"
        to_stdout = as_json or form == "text"
        return (None if to_stdout else Path("results", f"report{ENDINGS[form]}")), form
    found = form or SUFFIXES.get(output.suffix.lower())
    if found is None:
        endings = ", ".join(SUFFIXES)
        raise click.UsageError(
            f"the name of {output} does not say the format: expected one of {endings}, or --format"
        )
    return output, found


def _refuse_inputs(path: Path | None, results: tuple[Path, ...]) -> None:
    """A report never takes the place of what it is made from."""
    if path is not None and any(_same(path, result) for result in results):
        raise click.UsageError(f"{path} is one of the results: choose another name with -o")


def _same(path: Path, other: Path) -> bool:
    try:
        return path.samefile(other)
    except (OSError, ValueError):
        return False


def _put(report: "Report", path: Path | None, form: str, *, force: bool, as_json: bool) -> None:
    if path is not None:
        from rbstab.report.writers.write import write_report

        write_report(report, path, form, force=force)
    if as_json:
        from rbstab.report.writers.plain_data import data_of
        from rbstab_cli.output.json_output import print_json

        print_json(data_of(report))
    elif path is None:
        from rich.console import Console

        from rbstab.report.writers.text import print_report

        # As wide as the terminal; 80 columns where there is none.
        print_report(report, Console(highlight=False))


def _command(
    results: tuple[Path, ...],
    output: Path | None,
    form: str,
    title: str | None,
    *,
    force: bool,
    as_json: bool,
) -> str:
    """The command line that makes the report again."""
    from rbstab.report.model.words import shell_word

    words = ["rbstab", "report", *_names(results)]
    words += ["-o", shell_word(output)] if output is not None else []
    words += ["--format", form] if output is not None or not as_json else []
    words += ["--title", shlex.quote(title)] if title is not None else []
    words += ["--force"] if force else []
    words += ["--json"] if as_json else []
    return " ".join(words)


def _names(results: tuple[Path, ...]) -> list[str]:
    """The results as a command names them; all of a folder by the pattern that finds them."""
    from rbstab.report.model.words import shell_word

    found: list[str] = []
    for folder, group in groupby(results, key=lambda result: result.parent):
        files = list(group)
        there = sorted(path for path in folder.glob("*.h5") if not path.name.startswith("."))
        if len(files) > MANY and files == there:
            found.append("*.h5" if folder == Path() else f"{shell_word(folder)}/*.h5")
        else:
            found += map(shell_word, files)
    return found
