"""A line about stored proofs that cannot be read; the results beside them are shown without."""

from collections.abc import Iterable
from pathlib import Path

import click


def print_unread_proofs(folders: Iterable[Path]) -> None:
    """Print for each folder of results why its proofs cannot be read; nothing if they can be."""
    from rbstab.experiment.proof_cache import why_unreadable

    for folder in dict.fromkeys(folders):
        reason = why_unreadable(folder)
        if reason:
            click.echo(f"warning: {reason}. The results are shown without them.", err=True)


def results_folder_of(path: Path) -> Path:
    """Return the folder of results that a result is in; a folder of results is its own."""
    from rbstab.listing.folder import listed_folder
    from rbstab.listing.kinds import Kind, kind_of, sweep_folder_of
    from rbstab.store.errors import StoreError

    try:
        kind = kind_of(path)
        if kind is Kind.FOLDER:
            return listed_folder(path)
        return sweep_folder_of(path).parent if kind is Kind.SWEEP else path.parent
    except StoreError:
        return path.parent  # reading the result gives the reason
