"""`rbstab compare`: how two results differ, as tables or as JSON."""

from collections.abc import Sequence
from pathlib import Path

import click

from rbstab.listing.comparison import Row
from rbstab.listing.comparison import compare as differences
from rbstab_cli.output.runs import print_unread_proofs
from rbstab_cli.printing import Table, print_json, say
from rbstab_cli.results import results_folder_of


def compare(first: Path, second: Path, as_json: bool) -> None:
    """Print what differs between two results.

    Args:
        first: The file of a run, or the folder of a sweep; or a folder with one result.
        second: The other one, of the same kind.
        as_json: Whether to print JSON.
    """
    comparison = differences(first, second)
    print_unread_proofs(map(results_folder_of, (first, second)))
    if as_json:
        rows = {
            name: [row._asdict() for row in getattr(comparison, name)]
            for name in ("inputs", "outcomes")
        }
        same = {"kind": comparison.kind, "same_system": comparison.same_system}
        print_json({"first": str(first), "second": str(second), **same, **rows})
        return
    names = (first.name, second.name) if first.name != second.name else (str(first), str(second))
    heads = names if names[0] != names[1] else ("A", "B")
    what = "config" if comparison.kind == "run" else "plan"
    if comparison.inputs:
        _print(Table(f"{what} key", *heads), comparison.inputs)
    else:
        click.echo(f"The {what}s are equal.\n")
    _print(Table("outcome", *heads, "B/A", numbers=("B/A",)), comparison.outcomes)
    if comparison.kind == "run" and not comparison.same_system:
        say(
            "v(0) and v(end) have no ratio: v depends on body, gravity, controller and elements, "
            "which differ."
        )


def _print(table: Table, rows: Sequence[Row]) -> None:
    for row in rows:
        table.add(*row[: len(table.columns)])
    table.print()
