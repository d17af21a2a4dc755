"""Stored proofs within tolerances, of all bodies or of all starts, in a folder of results."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeVar

from rbstab.config.schema import Config
from rbstab.config.tolerances import Tolerance
from rbstab.experiment.proof_cache import NO_FILE_ERRORS, PROOFS, stored_model
from rbstab.experiment.robust.bodies import bodies_id, prove_within
from rbstab.experiment.robust.record import BodiesRecord, WithinRecord, bounds_of
from rbstab.store.document import write_document
from rbstab.store.errors import StoreError

Record = TypeVar("Record", bound=WithinRecord)


def kept_file(folder: Path, kind: type[WithinRecord], identity: str) -> Path:
    """Return the file of a proof in a folder of results."""
    return folder / PROOFS / f"{kind.PREFIX}{identity}.json"


def kept(folder: Path, kind: type[Record], identity: str) -> Record | None:
    """Return a stored proof of one kind; None if it is missing or damaged.

    Raises:
        StoreError: The disk reports an error; the proof may be whole.
    """
    found = stored_model(kept_file(folder, kind, identity), kind)
    return found if found is not None and found.id == identity else None


def keep(folder: Path, record: WithinRecord) -> None:
    """Store a proof in a folder of results.

    Raises:
        StoreError: The proof cannot be written.
    """
    write_document(kept_file(folder, type(record), record.id), record.model_dump(mode="json"))


def bodies_for(
    folder: Path,
    config: Config,
    tolerances: Sequence[Tolerance],
    is_late: Callable[[], bool] = lambda: False,
) -> BodiesRecord:
    """Return the stored proof for tolerances of a config; if there is none, make and store it.

    A brief one that decided nothing is made again.

    Args:
        folder: The folder of results.
        config: The config.
        tolerances: Tolerances of body, gravity and controller.
        is_late: As for `prove_within`.

    Raises:
        StoreError: The proof cannot be written, or the disk fails to read it.
    """
    found = kept(folder, BodiesRecord, bodies_id(config, bounds_of(tolerances)))
    if found is None or found.brief:
        found = prove_within(config, tolerances, is_late=is_late)
        keep(folder, found)
    return found


def all_bodies(folder: Path) -> list[BodiesRecord]:
    """Return all stored proofs for bodies within tolerances, in the order of their names.

    Damaged files are left out.

    Raises:
        StoreError: The disk reports an error.
    """
    prefix, end = BodiesRecord.PREFIX, ".json"
    try:
        files = [path.name for path in (folder / PROOFS).iterdir()]
    except OSError as error:
        if error.errno in NO_FILE_ERRORS:
            return []  # as a single proof there
        raise StoreError(f"{folder} cannot be read: {error.strerror or error}") from error
    names = sorted(name for name in files if name.startswith(prefix) and name.endswith(end))
    found = [kept(folder, BodiesRecord, name[len(prefix) : -len(end)]) for name in names]
    return [record for record in found if record is not None]
