"""`rbstab plot`: one figure of a report as a file."""

from pathlib import Path

import click

from rbstab.config.errors import hint
from rbstab.report.build import report_of
from rbstab.report.model.figure import Figure
from rbstab.report.reading.sources import read_sources
from rbstab.report.writers.figure_files import figure_bytes, figures_of
from rbstab.store.disk.paths import path_exists
from rbstab.store.errors import StoreError
from rbstab_cli import exit_codes
from rbstab_cli.errors import Failed
from rbstab_cli.output.files import figure_form, write_file
from rbstab_cli.output.progress import working
from rbstab_cli.printing import print_facts, say
from rbstab_cli.results import Taken, taken


def plot(
    results: tuple[Path, ...], name: str | None, output: Path | None, column: bool, force: bool
) -> None:
    """Write a figure, or list all of them."""
    form = None if output is None else figure_form("-o", output, force=force)
    if column and form == "csv":
        raise click.UsageError("--column is of use only with -o FILE that ends in .svg, .pdf, .png")
    with working("figures"):
        figures = _figures(taken(results))
    if name is None or output is None or form is None:
        print_facts(((name, figure.title) for name, figure in figures.items()), "figure", "title")
        return
    if name not in figures:
        expected = f"{', '.join(figures)}{hint(name, figures)}"
        raise click.UsageError(f"--figure {name}: unknown; expected one of {expected}")
    write_file(output, figure_bytes(figures[name], form, column=column), force=force)
    say(f"-> {output}")


def _figures(named: Taken) -> dict[str, Figure]:
    """Return the figures of the report on some results, by name."""
    sources = read_sources(named.paths)
    lines = [
        f"{unread.path}: {unread.reason}{_hint(Path(unread.path))}" for unread in sources.unread
    ]
    # A result that the user named must be readable; of a folder, the others are drawn.
    readable = sources.runs or sources.sweeps
    if not readable or any(Path(unread.path) not in named.in_folders for unread in sources.unread):
        raise Failed(exit_codes.STORAGE, *lines)
    for line in lines:
        say(line)
    return figures_of(report_of(sources, ""))


def _hint(path: Path) -> str:
    """Return the end of a message if an argument that is no file may be the name of a figure."""
    try:
        may_be_figure = path.name == str(path) and not path.suffix and not path_exists(path)
    except StoreError:
        return ""
    return "; a figure is named by --figure NAME" if may_be_figure else ""
