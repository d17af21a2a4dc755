"""The proofs that a path on the command line names: one file, or all in a folder of results."""

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, NoReturn

import click

from rbstab_cli import exit_codes

if TYPE_CHECKING:
    from rbstab.config.schema import Config


class ProofFiles(NamedTuple):
    """Files of proofs of rest states, and the number of proofs within tolerances beside them."""

    files: list[Path]
    others: int


def is_other_proof(path: Path) -> bool:
    """Whether a file is a proof for all bodies, or for all starts, within tolerances."""
    from rbstab.experiment.proof_cache import WITHIN_TOLERANCES

    return path.name.startswith(WITHIN_TOLERANCES)


def proofs_of_folder(folder: Path, config: "Config | None") -> ProofFiles:
    """Return the proofs in a folder of results, or in its folder of proofs.

    If there is none, print a message and end the command with exit code 4.

    Args:
        folder: The folder of results, or of proofs.
        config: Only the proof of this config is returned; None: all proofs.
    """
    from rbstab.experiment.proof_cache import PROOFS, proof_file

    place = folder if folder.absolute().name == PROOFS else folder / PROOFS
    try:
        found = sorted(path for path in place.iterdir() if path.suffix == ".json")
    except (FileNotFoundError, NotADirectoryError):
        found = []
    except OSError as error:
        _fail(f"error: {place} cannot be read: {error.strerror or error}")
    files = [path for path in found if not is_other_proof(path)]
    if config is not None:
        name = proof_file(folder, config).name
        files = [path for path in files if path.name == name]
    if not files:
        whose = " of this config" if config is not None else ""
        _fail(
            f"{folder} has no proof{whose} that can be checked. Proofs are in DIR/proofs of a "
            "folder of results DIR; `rbstab stability` and `rbstab run` write them."
        )
    return ProofFiles(files, sum(map(is_other_proof, found)))


def _fail(message: str) -> NoReturn:
    click.echo(message, err=True)
    raise click.exceptions.Exit(exit_codes.STORAGE)
