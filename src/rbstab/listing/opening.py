"""Open a result, a sweep or a proof; of another file, say what it is and what opens it."""

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from rbstab.store.errors import NewerSchemaError, NotAResultError, StoreError

if TYPE_CHECKING:
    from rbstab.experiment.answers.result import Result
    from rbstab.experiment.stored_proof.proof import Proof
    from rbstab.store.table import Table

T = TypeVar("T")

MAX_NAMED = 4
"""The most results that a message names."""


def open_result(path: str | Path) -> "Result":
    """Read the result of a run from its file.

    Args:
        path: The file, such as `results/case1_permanent.h5`.

    Returns:
        The result, with all arrays in memory.

    Raises:
        NewerSchemaError: The file was written by a newer rbstab.
        NotAResultError: The file is damaged, or is not the result of a run. If it is a sweep, a
            proof, a config or a folder, the message names the function that opens it.
        StoreError: The file cannot be opened.
    """
    from rbstab.experiment.answers.result import Result
    from rbstab.store import result

    stored = _opened(result.open_result, path, "the result of a run")
    return Result(stored.variables, stored.attributes, stored.config)


def open_sweep(path: str | Path) -> "Table":
    """Read a finished sweep: the values of the varied keys and the results of all members.

    Args:
        path: The folder of the sweep.

    Returns:
        A table with one row for each member.

    Raises:
        NotAResultError: The file is damaged, or is not a sweep; as for `open_result`.
        NewerSchemaError: The file was written by a newer rbstab.
        StoreError: The file cannot be opened, or the sweep is not finished.
    """
    from rbstab.sweep.folder import sweep_table

    return _opened(sweep_table.open_sweep, path, "a sweep")


def open_proof(path: str | Path) -> "Proof":
    """Read a proof of rest states, as `rbstab stability` and `rbstab run` store it in DIR/proofs.

    Args:
        path: The file, such as `results/proofs/0123456789abcdef.json`.

    Returns:
        The proof, as `prove` returns it. It is not checked again; `rbstab verify` does that.

    Raises:
        NotAResultError: The file is damaged, or is not such a proof; as for `open_result`.
        StoreError: The file cannot be opened.
    """
    from rbstab.experiment.stored_proof.proof import Proof
    from rbstab.store.document import read_model

    return _opened(lambda file: read_model(file, Proof), path, "a proof of rest states")


def _opened(read: Callable[[Path], T], path: str | Path, wanted: str) -> T:
    """Read a file; if it is of another kind, the error says which, and what opens it."""
    path = Path(path)
    try:
        return read(path)
    except NewerSchemaError:
        raise
    except StoreError as error:
        try:
            found = _what_it_is(path)
        except (StoreError, OSError):
            found = None
        if found is None or found[0] == wanted:
            raise
        what, hint = found
        raise NotAResultError(f"{path} is {what}, not {wanted}. {hint}") from error


def _what_it_is(path: Path) -> tuple[str, str] | None:
    """Return what a path leads to, and what opens it; None if it is not known."""
    from rbstab.experiment.proof_cache import WITHIN_TOLERANCES
    from rbstab.listing.kinds import Kind, kind_of, sweep_folder_of

    kind = kind_of(path)
    if kind is Kind.PROOF and path.name.startswith(WITHIN_TOLERANCES):
        return "a proof within tolerances", "`rbstab show` prints it."
    whole = _open_it("open_sweep", sweep_folder_of(path), "Open the sweep")
    known = {
        Kind.SWEEP: ("a sweep", _open_it("open_sweep", path)),
        Kind.PART: ("a part of a sweep", whole),
        Kind.PROOF: ("a proof of rest states", _open_it("open_proof", path)),
        Kind.PROOFS: ("a folder of proofs", "Name one of its files."),
    }
    if kind in known:
        return known[kind]
    return _folder(path) if kind is Kind.FOLDER else _other(path)


def _other(path: Path) -> tuple[str, str] | None:
    """Return what a file is that is told by its text, or a result that is not damaged."""
    from rbstab.report.reading.not_results import CONFIG, PARTS, PLAN, what_it_is
    from rbstab.store.result import open_result

    what = what_it_is(path)
    if what is None:
        with suppress(StoreError):
            open_result(path)
            return "the result of a run", _open_it("open_result", path)
        return None
    hints = {
        CONFIG: _open_it("simulate", path, "Run it"),
        PLAN: f"{_open_it('load_plan', path, 'Load it')}; `rbstab sweep` runs it",
        **dict.fromkeys(PARTS.values(), _open_it("open_sweep", path.parent, "Open the sweep")),
    }
    return what, hints.get(what, "Results of runs end with .h5.")


def _folder(path: Path) -> tuple[str, str]:
    """Return what a folder is, and which results in it can be opened."""
    from rbstab.listing.folder import results_in
    from rbstab.report.model.words import listed

    found = listed(map(str, results_in(path)), MAX_NAMED)
    if not found:
        return "a folder without results", "Name the file of a run, or the folder of a sweep."
    return "a folder", f"The results in it: {found}."


def _open_it(function: str, path: Path, task: str = "Open it") -> str:
    return f"{task}: rbstab.{function}({str(path)!r})"
