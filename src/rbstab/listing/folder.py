"""The runs and sweeps in a folder of results, each with what it says of itself."""

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NamedTuple

from rbstab.experiment.answers.assessed_run import AssessedRun
from rbstab.experiment.answers.facts import FACTS
from rbstab.experiment.proof_cache import PROOFS, why_unreadable
from rbstab.experiment.stored_run import stored_config
from rbstab.files.text import grouped, shell_word
from rbstab.processes.mapped import mapped
from rbstab.report.model.words import listed
from rbstab.report.reading.kinds import RESULT, Kind, kind_of
from rbstab.store.disk.paths import path_exists, path_is_dir, path_is_file
from rbstab.store.errors import StoreError
from rbstab.store.result import open_result
from rbstab.sweep.folder.member_answers import SWEEP_FACTS, member_answers
from rbstab.sweep.folder.sweep_folder import SWEEP_FILE, read_folder

UNKNOWN = "-"

NOT_PROVED = "not proved"
"""What a sweep says of its members if none is covered by a proof."""

RESULTS = "results"
"""The name of the default folder of results, which is searched in a folder without results."""

FIRST = "`rbstab run CONFIG` stores results, and `rbstab init` writes a first config"
"""What to do where nothing was run yet."""

MAX_NAMED = 6
"""The most results that a message names."""


class Entry(NamedTuple):
    """A run or a sweep in a folder.

    Attributes:
        path: Its file or folder.
        kind: Whether it is a run or a sweep.
        title: Its title; empty if it cannot be read.
        outcome: Where the body of a run rests; what became of the members of a sweep.
        status: How the run ended; how many members of a sweep completed.
        verdict: The verdict of the certificate of a run.
        converges: What is proved of the exact motion; how many members of a sweep are proved.
        this_start: How sure it is that the motion of a run comes to rest, in a word; how many
            members of a sweep are proved to.
        whole_range: How sure it is where all motions that stay in the range end, in a word.
        modified: When the file was written, s since the epoch.
        problem: Why it cannot be read; empty if it was read.
    """

    path: Path
    kind: Kind
    title: str = ""
    outcome: str = UNKNOWN
    status: str = UNKNOWN
    verdict: str = UNKNOWN
    converges: str = UNKNOWN
    this_start: str = UNKNOWN
    whole_range: str = UNKNOWN
    modified: float = 0.0
    problem: str = ""


@contextmanager
def checked_content(path: Path) -> Iterator[None]:
    """Turn what the content of a result raises into an error that names its file.

    Anybody may have written the file, and no check foresees everything.

    Raises:
        StoreError: The block raised such an error.
    """
    try:
        yield
    except (LookupError, ValueError, TypeError, ArithmeticError, AttributeError) as error:
        reason = f"{type(error).__name__}: {error}"
        raise StoreError(f"{path}: its content is wrong ({reason})") from error


def results_in(folder: Path) -> list[Path]:
    """Return the files of runs and the folders of sweeps in a folder, in the order of their names.

    If a folder has none, those in its own folder `results` are returned. A file is taken for a run
    by its ending; it is not read.

    Raises:
        StoreError: The folder cannot be read.
    """
    return _results_in(listed_folder(folder))


def listed_folder(folder: Path) -> Path:
    """Return the folder whose results `results_in` returns: it, or its own folder `results`.

    Raises:
        StoreError: As `results_in`.
    """
    inner = folder / RESULTS
    return inner if _kind(inner) is Kind.FOLDER and not _results_in(folder) else folder


def _results_in(folder: Path) -> list[Path]:
    try:
        paths = [path for path in folder.iterdir() if not path.name.startswith(".")]
    except FileNotFoundError as error:
        raise StoreError(f"{folder} cannot be read: {error.strerror}; {FIRST}") from error
    except OSError as error:
        raise StoreError(f"{folder} cannot be read: {error.strerror or error}") from error
    return [path for path in sorted(paths) if _kind(path) in (Kind.RUN, Kind.SWEEP)]


def _kind(path: Path) -> Kind | None:
    """Return the kind of a result or a folder in a folder; None for other files."""
    try:
        return kind_of(path) if path.suffix == RESULT or path_is_dir(path) else None
    except StoreError:
        # It may be a result: what cannot be tested must not hide others, and reading it says why.
        if path.name == PROOFS:
            return Kind.PROOFS
        return Kind.RUN if path.suffix == RESULT else Kind.SWEEP


def only_result(path: Path) -> Path:
    """Return the only result in a folder; a path without results in it is returned as it is.

    Raises:
        StoreError: The folder cannot be read, or has several results.
    """
    if kind_of(path) is not Kind.FOLDER:
        return path
    results = results_in(path)
    if not results:
        return path  # reading it says so
    if len(results) > 1:
        names = listed(map(shell_word, results), MAX_NAMED)
        raise StoreError(f"{path} has {len(results)} results. Name one of them: {names}")
    return results[0]


def entries_of(folder: Path) -> list[Entry]:
    """Return the runs and sweeps in a folder, the newest first. A sweep lists itself.

    A folder without results lists those in its folder `results`.

    Raises:
        StoreError: The folder cannot be read.
    """
    kind = kind_of(folder)
    if kind is Kind.SWEEP:
        return [_entry(folder, Kind.SWEEP)]
    if kind is not Kind.FOLDER and path_is_file(folder):
        raise StoreError(
            f"{folder} is a file. List the folder it is in: rbstab list {shell_word(folder.parent)}"
        )
    kinds = {path: _kind(path) for path in results_in(folder)}
    runs = [path for path, kind in kinds.items() if kind is Kind.RUN]
    entries = list(mapped(_entry, runs))
    entries += [_entry(path, Kind.SWEEP) for path, kind in kinds.items() if kind is Kind.SWEEP]
    return sorted(entries, key=lambda entry: (-entry.modified, entry.path.name))


def proofs_in(folder: Path) -> list[Path]:
    """Return the files of the stored proofs in a folder of results, in the order of their names."""
    try:
        return sorted(path for path in (folder / PROOFS).iterdir() if path.suffix == ".json")
    except OSError:
        return []


def _entry(path: Path, kind: Kind = Kind.RUN) -> Entry:
    file = path / SWEEP_FILE if kind is Kind.SWEEP else path
    entry = Entry(path, kind)
    try:
        modified = (file if path_exists(file) else path).stat().st_mtime
        said = _said_by_sweep(path) if kind is Kind.SWEEP else _said_by_run(path)
    except (StoreError, OSError) as error:
        return entry._replace(problem=str(error))
    return entry._replace(**said, modified=modified)


def _said_by_run(path: Path) -> dict[str, Any]:
    """Return what a run says of itself, as fields of its entry."""
    result = open_result(path)
    answers: dict[str, str] = {}
    # A result of an old or an unusual layout is listed all the same.
    with suppress(StoreError), checked_content(path):
        run = AssessedRun(path, result, stored_config(result).config)
        answers = {
            name.replace(" ", "_"): FACTS[name].of(run).text
            for name in ("outcome", "this start", "whole range")
        }
        result = run.now
    attributes = result.attributes
    return answers | {
        "title": str(attributes["title"]),
        "status": str(attributes["status"]),
        "verdict": str(attributes.get("verdict", UNKNOWN)),
        "converges": str(attributes.get("convergence", UNKNOWN)),
    }


def _said_by_sweep(path: Path) -> dict[str, Any]:
    """Return what a sweep says of itself, as fields of its entry."""
    folder = read_folder(path)
    title, members = folder.manifest.title, folder.manifest.members
    if not path_is_file(folder.sweep_file):
        stored = f"{grouped(len(folder.stored_shards()))} of {grouped(folder.shards)}"
        return {"title": title, "status": f"{stored} shards are stored"}
    answers = member_answers(folder.sweep_file)
    proved = f"{grouped(answers.proved)} of {grouped(members)} proved"
    # Proofs that cannot be read may say something.
    nothing = UNKNOWN if why_unreadable(path.absolute().parent) else NOT_PROVED
    return {
        "title": title,
        "outcome": SWEEP_FACTS["outcome"].of(answers).text,
        "status": f"{grouped(answers.completed)} of {grouped(members)} completed",
        "converges": proved if answers.any_proof else UNKNOWN,
        "this_start": proved if answers.any_proof else nothing,
    }
