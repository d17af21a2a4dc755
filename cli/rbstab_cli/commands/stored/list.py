"""`rbstab list`."""

from pathlib import Path

import click

from rbstab_cli import exit_codes
from rbstab_cli.arguments.options import AS_JSON


@click.command("list")
@click.argument("folder", default="results", metavar="[DIR]", type=click.Path(path_type=Path))
@AS_JSON
def command(folder: Path, as_json: bool) -> None:
    """List the runs and sweeps in a folder of results, the newest first.

    DIR is results by default. For each run: its status, what its checks found, how sure it is that
    this start comes to rest, and that the whole range does, and its age. For each sweep: how many
    members completed, and how many are proved to come to rest. Proofs that were stored later count
    too. A file that cannot be read is listed with the reason; the exit code is then 4.
    """
    from rbstab.store.errors import StoreError
    from rbstab_cli.output.listing import report_entries

    try:
        unread = report_entries(folder, as_json=as_json)
    except StoreError as error:
        click.echo(f"error: {error}", err=True)
        raise click.exceptions.Exit(exit_codes.STORAGE) from error
    raise click.exceptions.Exit(exit_codes.STORAGE if unread else exit_codes.OK)
