"""`rbstab plot`."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from rbstab_cli import exit_codes
from rbstab_cli.arguments.results import Taken, results_among, with_folders

if TYPE_CHECKING:
    from rbstab.report.model.figure import Figure


@click.command("plot")
@click.argument(
    "results", nargs=-1, required=True, metavar="RESULT...", type=click.Path(path_type=Path)
)
@click.option("--figure", "name", metavar="NAME", help="The figure; without it they are listed.")
@click.option(
    "-o",
    "--output",
    metavar="FILE",
    type=click.Path(path_type=Path),
    help="File of the figure: .svg, .pdf or .png, 170 mm wide; .csv has its data.",
)
@click.option(
    "--column",
    is_flag=True,
    help="Draw it 80 mm wide, for one column of a paper: its panels are below each other.",
)
@click.option("--force", is_flag=True, help="Replace FILE if it exists.")
def command(
    results: tuple[Path, ...],
    name: str | None,
    output: Path | None,
    column: bool,
    force: bool,
) -> None:
    """Draw one figure of runs and sweeps, or write its data.

    The figures are those of `rbstab report` on the same results, which may be folders of results.
    Without --figure their names and titles are listed. The drawing has no title: that is left to
    the caption of the paper.
    """
    from rbstab.config.errors import hint
    from rbstab.report.writers.figure_files import FORMS, figure_bytes, form_of
    from rbstab_cli.output.progress import working
    from rbstab_cli.output.text_file import check_target

    form = None if output is None else form_of(output)
    if (name is None) != (output is None):
        raise click.UsageError("give both --figure NAME and -o FILE, or none of them")
    if output is not None and form is None:
        endings = ", ".join(f".{ending}" for ending in FORMS)
        raise click.UsageError(f"-o {output}: expected a file name that ends in {endings}")
    if column and form in (None, "csv"):
        raise click.UsageError("--column is of use only with -o FILE that ends in .svg, .pdf, .png")
    if form is not None and form != "csv":
        _check_drawing()
    if output is not None:
        check_target(output, force=force)
    with working("figures", wanted=True):
        figures = _figures(with_folders(results_among(results)))
    if name is None or output is None or form is None:
        _list(figures)
        return
    if name not in figures:
        one_of = f"{', '.join(figures)}{hint(name, figures)}"
        raise click.UsageError(f"--figure {name}: unknown; expected one of {one_of}")
    figure = figures[name]
    content = figure_bytes(figure, form, column=column)
    _write(output, content, force=force)


def _check_drawing() -> None:
    from importlib.util import find_spec

    if find_spec("vl_convert") is None:
        raise click.UsageError(
            "drawings need vl-convert-python, which a plain install lacks. Run "
            '`pip install "rbstab[report]"`; a .csv file needs nothing more.'
        )


def _figures(taken: Taken) -> "dict[str, Figure]":
    """Return the figures of the report on some results, by name.

    A result that the user named must be readable; of those in a folder, the others are drawn.
    """
    from rbstab.report.build import report_of
    from rbstab.report.reading.sources import read_sources
    from rbstab.report.writers.figure_files import figures_of
    from rbstab.store.errors import StoreError

    try:
        sources = read_sources(taken.paths)
        for unread in sources.unread:
            click.echo(f"{unread.path}: {unread.reason}{_hint(Path(unread.path))}", err=True)
        found = [*sources.runs, *sources.sweeps]
        if not found or any(Path(one.path) not in taken.in_folders for one in sources.unread):
            raise click.exceptions.Exit(exit_codes.STORAGE)
        return figures_of(report_of(sources, ""))
    except StoreError as error:
        click.echo(f"error: {error}", err=True)
        raise click.exceptions.Exit(exit_codes.STORAGE) from error


def _hint(path: Path) -> str:
    """Return the end of a message if an argument that is no file may be the name of a figure."""
    from rbstab.store.disk.paths import path_exists
    from rbstab.store.errors import StoreError

    try:
        may_be_figure = path.name == str(path) and not path.suffix and not path_exists(path)
    except StoreError:
        return ""
    return "; a figure is named by --figure NAME" if may_be_figure else ""


def _list(figures: "dict[str, Figure]") -> None:
    from rbstab_cli.output.tables import add_row, new_table, print_table

    table = new_table("figure", "title")
    for name, figure in figures.items():
        add_row(table, name, figure.title)
    print_table(table)


def _write(path: Path, content: bytes, *, force: bool) -> None:
    from rbstab.store.disk.atomic import write_atomically
    from rbstab.store.errors import StoreError

    try:
        write_atomically(path, content, replace=force)
    except (OSError, StoreError) as error:
        reason = getattr(error, "strerror", None) or error
        click.echo(f"{path}: cannot be written: {reason}", err=True)
        raise click.exceptions.Exit(exit_codes.STORAGE) from error
    click.echo(f"-> {path}", err=True)
