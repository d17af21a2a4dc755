"""The results among the files and folders that a user names, as in `results/*`, and in folders."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

from rbstab.files.paths import is_dir, is_file
from rbstab.listing.folder import listed_folder, results_in
from rbstab.report.model.words import counted, listed, untrusted
from rbstab.report.reading.kinds import Kind, kind_of, sweep_folder_of
from rbstab.report.writers.signature import pictures_folder
from rbstab.store.errors import StoreError
from rbstab.sweep.folder.manifest import MANIFEST
from rbstab.sweep.folder.sweep_folder import SWEEP_FILE
from rbstab_cli.printing import hint, say

OTHER_FILES = (
    *(".html", ".htm", ".md", ".markdown", ".pdf", ".txt", ".log"),
    *(".svg", ".png", ".csv", ".json"),
)
"""Endings of files that stand beside results: reports, figures, data, notes and proofs."""

MAX_NAMED = 4
"""The most files that the note on what is left out names."""


class Taken(NamedTuple):
    """The results that were named, and those in the folders that were named.

    Attributes:
        paths: Files of runs, folders of sweeps, and whatever else was named.
        in_folders: Those of `paths` that were found in a folder. The user named none of them, so
            one that cannot be read does not hide the others.
    """

    paths: tuple[Path, ...]
    in_folders: frozenset[Path]


def taken(named: Sequence[Path]) -> Taken:
    """Return the results among some paths, those in a folder in place of the folder.

    Prints how many results a folder has. Sweeps in it that are not finished are left out, and
    named, if there are other results. A folder without results stays: reading it says so.

    Args:
        named: What the user named.
    """
    results: list[Path] = []
    in_folders: set[Path] = set()
    unfinished: set[Path] = set()
    paths = results_among(named)
    for path in paths:
        try:
            inside = results_in(path) if kind_of(path) is Kind.FOLDER else []
            without = set(filter(_is_unfinished, inside))
            sweeps = [is_dir(result) for result in inside]
        except (StoreError, OSError):
            # Reading it says why.
            results.append(path)
            continue
        counts = ((sweeps.count(False), "run"), (sweeps.count(True), "sweep"))
        if inside:
            words = " and ".join(counted(count, word) for count, word in counts if count)
            hint(f"{path}: {words}")
        results += inside or [path]
        in_folders.update(inside)
        unfinished |= without
    # One that is named, too, is not left out.
    unfinished -= set(paths)
    if unfinished and not unfinished.issuperset(results):
        say(_left_out("not finished", sorted(unfinished)))
        results = [path for path in results if path not in unfinished]
    return Taken(tuple(results), frozenset(in_folders.difference(paths)))


def results_among(paths: Sequence[Path]) -> tuple[Path, ...]:
    """Return the results among some paths, and print what else is left out.

    A pattern also matches proofs, reports, figures and notes, and the parts of a sweep. If nothing
    but these is named, all paths are returned: reading them says what they are.

    Args:
        paths: What the user named.
    """
    others = {path: None for path in paths if _stands_beside_results(path)}
    results = tuple(path for path in paths if path not in others)
    if not results or not others:
        return tuple(paths)
    hint(_left_out("not a result", others))
    return results


def _left_out(why: str, paths: Iterable[Path]) -> str:
    return f"Left out, {why}: {listed(map(untrusted, paths), MAX_NAMED)}"


def _is_unfinished(path: Path) -> bool:
    """Whether a path is the folder of a sweep that is not finished."""
    try:
        return is_dir(path) and not is_file(path / SWEEP_FILE)
    except PermissionError:
        return False  # reading it says so


def _stands_beside_results(path: Path) -> bool:
    """Whether a path is a file or folder that the program or a user keeps beside results."""
    try:
        kind, parent = kind_of(path), path.absolute().parent
        is_part = kind is not Kind.SWEEP and is_file(parent / MANIFEST)
        if kind is Kind.FOLDER:
            # Of the pictures of a report in Markdown.
            return path.absolute() in map(pictures_folder, parent.glob("*.md"))
        # A config is not left out: the message about it names the command that runs it.
        is_other = kind is Kind.RUN and path.suffix.lower() in OTHER_FILES and is_file(path)
        proofs = (Kind.PROOF, Kind.BOUND, Kind.TOLERANCES, Kind.PROOFS)
        return is_part or is_other or kind in (Kind.PART, *proofs)
    except (StoreError, OSError):
        # Reading it says why.
        return False


def results_folder_of(path: Path) -> Path:
    """Return the folder of results that a result is in; a folder of results is its own."""
    try:
        kind = kind_of(path)
        if kind is Kind.FOLDER:
            return listed_folder(path)
        return sweep_folder_of(path).parent if kind is Kind.SWEEP else path.parent
    except StoreError:
        return path.parent  # reading the result gives the reason
