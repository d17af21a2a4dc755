"""Folders of proofs, and the folders inside of a sweep, printed as a table or as JSON."""

from collections.abc import Sequence
from pathlib import Path

Rows = Sequence[dict[str, str]]


def print_inner_folder(path: Path, *, as_json: bool) -> bool:
    """Print what a folder of proofs, of shards or of traces holds; return whether it is one.

    Raises:
        StoreError: It cannot be read.
    """
    from rbstab.listing.inner_folders import InnerFolder, inner_folder, proof_rows, sweep_rows

    kind = inner_folder(path)
    if kind is None:
        return False
    rows = proof_rows(path) if kind is InnerFolder.PROOFS else sweep_rows(path)
    if as_json:
        from rbstab_cli.output.json_output import print_json

        print_json(rows)
        return True
    _print(path, kind, rows)
    return True


def _print(path: Path, kind: str, rows: Rows) -> None:
    import click

    from rbstab_cli.output.tables import add_row, new_table, print_table

    if not rows:
        click.echo(f"{path} has no {kind}.", err=True)
        return
    click.echo(f"{path}: {kind}")
    head, *others = rows[0]
    table = new_table(head, *others, words=(head,))
    for row in rows:
        add_row(table, *row.values())
    print_table(table)
