"""The results among the files and folders that a user names, as in `results/*`, and in folders."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

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


class Taken(NamedTuple):
    """The results that were named, and those in the folders that were named.

    Attributes:
        paths: Files of runs, folders of sweeps, and whatever else was named.
        in_folders: Those of `paths` that were found in a folder. The user named none of them, so
            one that cannot be read does not hide the others.
    """

    paths: tuple[Path, ...]
    in_folders: frozenset[Path]


def with_folders(paths: Sequence[Path], *, quiet: bool = False) -> Taken:
    """Return paths with the results in a folder in place of the folder, in the order of names.

    Prints how many results a folder has. Sweeps in it that are not finished are left out, and
    named, if there are other results. A folder without results stays: reading it says so.

    Args:
        paths: What the user named, from `results_among`.
        quiet: Whether to leave out how many results a folder has.
    """
    from rbstab.store.errors import StoreError

    found: list[Path] = []
    in_folders: set[Path] = set()
    unfinished: set[Path] = set()
    for path in paths:
        try:
            inside = _results_of_folder(path)
            without = set(filter(_is_unfinished, inside))
            counts = _counted(inside)
        except (StoreError, OSError):
            # Reading it says why.
            found.append(path)
            continue
        if inside and not quiet:
            click.echo(f"{path}: {counts}", err=True)
        found += inside or [path]
        in_folders.update(inside)
        unfinished |= without
    # One that is named, too, is not left out.
    unfinished -= set(paths)
    if unfinished and not unfinished.issuperset(found):
        from rbstab.report.model.words import listed, untrusted

        names = listed(map(untrusted, sorted(unfinished)), MAX_NAMED)
        click.echo(f"Left out, not finished: {names}", err=True)
        found = [path for path in found if path not in unfinished]
    return Taken(tuple(found), frozenset(in_folders.difference(paths)))


def _results_of_folder(path: Path) -> list[Path]:
    """Return the results in a folder; none if it is a sweep, or no folder.

    Raises:
        StoreError, OSError: It cannot be read.
    """
    from rbstab.listing.folder import results_in
    from rbstab.listing.kinds import Kind, kind_of

    return results_in(path) if kind_of(path) is Kind.FOLDER else []


def _counted(results: Iterable[Path]) -> str:
    """Return `3 runs and 1 sweep`; only sweeps are folders.

    Raises:
        OSError: The disk reports an error.
    """
    from rbstab.files.existence import is_dir
    from rbstab.report.model.words import counted

    sweeps = [is_dir(path) for path in results]
    counts = ((sweeps.count(False), "run"), (sweeps.count(True), "sweep"))
    return " and ".join(counted(count, word) for count, word in counts if count)


def _is_unfinished(path: Path) -> bool:
    """Whether a path is the folder of a sweep that is not finished.

    Raises:
        OSError: The disk reports an error.
    """
    from rbstab.files.existence import is_dir, is_file
    from rbstab.sweep.folder.sweep_folder import SWEEP_FILE

    try:
        return is_dir(path) and not is_file(path / SWEEP_FILE)
    except PermissionError:
        return False  # reading it says so


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
