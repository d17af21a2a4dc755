"""Open a result, a sweep or a proof; of another file, say what it is and what opens it."""

from collections.abc import Callable
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
            what, hint = _what_it_is(path)
        except StoreError:
            raise error from None
        if what == wanted:
            raise
        raise NotAResultError(f"{path} is {what}, not {wanted}. {hint}") from error


def _what_it_is(path: Path) -> tuple[str, str]:
    """Return what a path leads to, and what opens it; raise `StoreError` if it cannot be read."""
    from rbstab.listing.folder import results_in
    from rbstab.report.model.words import listed
    from rbstab.report.reading.kinds import Kind, kind_of, sweep_folder_of
    from rbstab.store.result import open_result

    kind = kind_of(path)
    if kind is Kind.FOLDER:
        names = listed(map(str, results_in(path)), MAX_NAMED)
        if not names:
            return "a folder without results", "Name the file of a run, or the folder of a sweep."
        return kind.words, f"The results in it: {names}."
    if kind is Kind.RUN:
        open_result(path)
    hints = {
        Kind.RUN: _open_it("open_result", path),
        Kind.SWEEP: _open_it("open_sweep", path),
        Kind.PART: _open_it("open_sweep", sweep_folder_of(path), "Open the sweep"),
        Kind.PROOF: _open_it("open_proof", path),
        **dict.fromkeys((Kind.BOUND, Kind.TOLERANCES), "`rbstab show` prints it."),
        Kind.PROOFS: "Name one of its files.",
        Kind.CONFIG: _open_it("simulate", path, "Run it"),
        Kind.PLAN: f"{_open_it('load_plan', path, 'Load it')}; `rbstab sweep` runs it",
    }
    return kind.words, hints.get(kind, "Results of runs end with .h5.")


def _open_it(function: str, path: Path, task: str = "Open it") -> str:
    return f"{task}: rbstab.{function}({str(path)!r})"
