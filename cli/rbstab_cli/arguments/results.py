"""The results among the files and folders that a shell pattern such as `results/*` names."""

from collections.abc import Sequence
from pathlib import Path

import click

OTHER_FILES = (
    *(".html", ".htm", ".md", ".markdown", ".pdf", ".txt", ".log"),
    *(".svg", ".png", ".csv", ".json"),
)
"""Endings of files that stand beside results: reports, figures, data, notes and proofs."""

MAX_NAMED = 4
"""The most files that the note on what is left out names."""


def results_among(paths: Sequence[Path], *, quiet: bool = False) -> tuple[Path, ...]:
    """Return the results among some paths, and print what else is left out.

    A pattern also matches proofs, reports, figures and notes, and the parts of a sweep. If nothing
    but these is named, all paths are returned: reading them says what they are.

    Args:
        paths: What the user named.
        quiet: Whether to leave out the note.
    """
    others = {path: None for path in paths if _stands_beside_results(path)}
    results = tuple(path for path in paths if path not in others)
    if not results or not others:
        return tuple(paths)
    if not quiet:
        from rbstab.report.model.words import listed, untrusted

        names = listed(map(untrusted, others), MAX_NAMED)
        click.echo(f"Left out, not a result: {names}", err=True)
    return results


def _stands_beside_results(path: Path) -> bool:
    """Whether a path is a file or folder that the program or a user keeps beside results."""
    from rbstab.store.errors import StoreError

    try:
        return _is_kept_beside(path)
    except (StoreError, OSError):
        # Reading it says why.
        return False


def _is_kept_beside(path: Path) -> bool:
    """Whether a path is no result.

    Raises:
        StoreError, OSError: The path cannot be tested.
    """
    from rbstab.files.existence import is_file
    from rbstab.listing.kinds import Kind, kind_of
    from rbstab.report.reading.not_results import CONFIG, PLAN, what_it_is

    kind = kind_of(path)
    if kind in (Kind.PROOF, Kind.SHARD) or (kind is not Kind.SWEEP and _is_in_sweep(path)):
        return True
    if kind is Kind.FOLDER:
        return _is_own_folder(path)
    # A config may have any name; the message about it names the command that runs it.
    is_other = path.suffix.lower() in OTHER_FILES and is_file(path)
    return is_other and what_it_is(path) not in (CONFIG, PLAN)


def _is_in_sweep(path: Path) -> bool:
    from rbstab.files.existence import is_file
    from rbstab.sweep.folder.manifest import MANIFEST

    return is_file(path.absolute().parent / MANIFEST)


def _is_own_folder(path: Path) -> bool:
    """Whether a folder has proofs, or the pictures of a report in Markdown."""
    from rbstab.experiment.proof_cache import PROOFS
    from rbstab.report.writers.signature import pictures_folder

    reports = path.absolute().parent.glob("*.md")
    return path.name == PROOFS or path.absolute() in map(pictures_folder, reports)
