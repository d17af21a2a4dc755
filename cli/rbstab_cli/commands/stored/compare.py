"""`rbstab compare`."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from rbstab_cli import exit_codes
from rbstab_cli.arguments.options import AS_JSON
from rbstab_cli.output.stored.unread_proofs import print_unread_proofs, results_folder_of

if TYPE_CHECKING:
    from rbstab.listing.comparison import Comparison, Row


@click.command("compare")
@click.argument("first", metavar="A", type=click.Path(path_type=Path))
@click.argument("second", metavar="B", type=click.Path(path_type=Path))
@AS_JSON
def command(first: Path, second: Path, as_json: bool) -> None:
    """Compare two results: what was run, and what came out.

    A and B are both files of runs, or both folders of sweeps. A folder with one result in it stands
    for this result. Prints the keys of their configs or plans that differ, and their outcomes
    beside each other. Proofs that were stored later count too.
    """
    from rbstab.listing.comparison import compare
    from rbstab.store.errors import StoreError

    try:
        found = compare(first, second)
    except StoreError as error:
        click.echo(f"error: {error}", err=True)
        raise click.exceptions.Exit(exit_codes.STORAGE) from error
    print_unread_proofs(map(results_folder_of, (first, second)))
    if as_json:
        from rbstab_cli.output.json_output import print_json

        print_json({"first": str(first), "second": str(second), **_data(found)})
        return
    names = _names(first, second)
    what = "config" if found.kind == "run" else "plan"
    if found.inputs:
        _print(f"{what} key", names, found.inputs, ratios=False)
    else:
        click.echo(f"The {what}s are equal.\n")
    _print("outcome", names, found.outcomes, ratios=True)
    if found.kind == "run" and not found.same_system:
        click.echo(
            "v(0) and v(end) have no ratio: v depends on body, gravity, controller and elements, "
            "which differ.",
            err=True,
        )


def _names(first: Path, second: Path) -> tuple[str, str]:
    """Return short and different names of two results for the heads of columns."""
    if first.name != second.name:
        return first.name, second.name
    return str(first), str(second)


def _print(head: str, names: tuple[str, str], rows: "list[Row]", *, ratios: bool) -> None:
    from rbstab_cli.output.tables import add_row, new_table, print_table

    one, other = names if names[0] != names[1] else ("A", "B")
    more = ("B/A",) if ratios else ()
    table = new_table(head, one, other, *more, numbers=more)
    for row in rows:
        ratio = (row.ratio,) if ratios else ()
        add_row(table, row.name, row.first, row.second, *ratio)
    print_table(table)


def _data(found: "Comparison") -> dict[str, object]:
    return {
        "kind": found.kind,
        "same_system": found.same_system,
        "inputs": [row._asdict() for row in found.inputs],
        "outcomes": [row._asdict() for row in found.outcomes],
    }
