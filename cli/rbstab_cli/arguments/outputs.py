"""Check the folder of results before the work of a command."""

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import click

from rbstab_cli import exit_codes

if TYPE_CHECKING:
    from rbstab.config.schema import Config
    from rbstab.store.errors import StoreError


def check_results_folder(folder: Path, results: Iterable[Path], *, force: bool = False) -> bool:
    """End the command with exit code 4 if nothing can be stored in the folder of its results.

    A folder that has all results is not tried: stored results are read from folders that nobody can
    write.

    Args:
        folder: The folder; it need not exist.
        results: The files or folders of the results.
        force: Whether all results are written again, so that the folder is always tried.

    Returns:
        Whether the folder was tried.
    """
    from rbstab.store.disk.paths import check_folder, path_exists
    from rbstab.store.errors import StoreError

    try:
        if not force and all(map(path_exists, results)):
            return False
        check_folder(folder)
    except StoreError as error:
        _fail(error, "-o names another folder")
    return True


def check_proofs_folder(folder: Path, has_all: Callable[[], bool]) -> None:
    """End the command with exit code 4 if no proof can be stored in a folder of results.

    Args:
        folder: The folder of results; it need not exist.
        has_all: Tells whether all proofs are stored there already.
    """
    from rbstab.experiment.proof_cache import PROOFS
    from rbstab.store.disk.paths import check_folder
    from rbstab.store.errors import StoreError

    try:
        check_folder(folder / PROOFS)
    except StoreError as error:
        if not has_all():
            _fail(error, "-o names another folder, --no-prove makes no proofs")


def has_all_proofs(folder: Path, configs: "Iterable[Config]", *, brief: bool) -> bool:
    """Whether the proofs of some configs are stored in a folder of results."""
    from rbstab.experiment.proof_cache import sufficient_proof
    from rbstab.store.errors import StoreError

    try:
        return all(sufficient_proof(folder, one, brief=brief) is not None for one in configs)
    except StoreError:
        return False


def _fail(error: "StoreError", what_to_do: str) -> None:
    click.echo(f"error: {error}. Nothing was run; {what_to_do}.", err=True)
    raise click.exceptions.Exit(exit_codes.STORAGE) from error
