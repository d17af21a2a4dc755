"""Check the folder of results before the work of a command."""

from collections.abc import Iterable
from pathlib import Path

import click

from rbstab_cli import exit_codes


def check_results_folder(folder: Path, results: Iterable[Path]) -> None:
    """End the command with exit code 4 if nothing can be stored in the folder of its results.

    A folder that has all results is not tried: stored results are read from folders that nobody can
    write.

    Args:
        folder: The folder; it need not exist.
        results: The files or folders of the results.
    """
    from rbstab.store.disk.existence import check_folder, path_exists
    from rbstab.store.errors import StoreError

    try:
        if not all(map(path_exists, results)):
            check_folder(folder)
    except StoreError as error:
        click.echo(f"error: {error}. Nothing was run; -o names another folder.", err=True)
        raise click.exceptions.Exit(exit_codes.STORAGE) from error
