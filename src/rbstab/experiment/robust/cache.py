"""Stored proofs for all bodies within tolerances, in a folder of results."""

from collections.abc import Callable, Sequence
from pathlib import Path

from rbstab.config.schema import Config
from rbstab.config.tolerances import Tolerance
from rbstab.experiment.proof_cache import NO_FILE_ERRORS, stored_model
from rbstab.experiment.robust.bodies import bodies_id, prove_within, stored
from rbstab.experiment.robust.record import BodiesRecord
from rbstab.store.document import write_document
from rbstab.store.errors import StoreError

PREFIX = "within-"
"""The beginning of the names of these files, which tells them from proofs of one config."""


def bodies_file(folder: Path, identity: str) -> Path:
    """Return the file of a proof in a folder of results."""
    return folder / "proofs" / f"{PREFIX}{identity}.json"


def cached_bodies(folder: Path, identity: str) -> BodiesRecord | None:
    """Return a stored proof; None if it is missing or damaged.

    Raises:
        StoreError: The disk reports an error; the proof may be whole.
    """
    found = stored_model(bodies_file(folder, identity), BodiesRecord)
    return found if found is not None and found.id == identity else None


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
    found = kept_bodies(folder, config, tolerances)
    if found is None or found.brief:
        found = prove_within(config, tolerances, is_late=is_late)
        keep_bodies(folder, found)
    return found


def kept_bodies(
    folder: Path, config: Config, tolerances: Sequence[Tolerance]
) -> BodiesRecord | None:
    """Return the stored proof for tolerances of a config; None if there is none.

    Raises:
        StoreError: The disk reports an error.
    """
    return cached_bodies(folder, bodies_id(config, stored(tolerances)))


def keep_bodies(folder: Path, record: BodiesRecord) -> None:
    """Store a proof in a folder of results.

    Raises:
        StoreError: The proof cannot be written.
    """
    write_document(bodies_file(folder, record.id), record.model_dump(mode="json"))


def all_bodies(folder: Path) -> list[BodiesRecord]:
    """Return all stored proofs for bodies within tolerances, in the order of their names.

    Damaged files are left out.

    Raises:
        StoreError: The disk reports an error.
    """
    try:
        files = [path.name for path in (folder / "proofs").iterdir()]
    except OSError as error:
        if error.errno in NO_FILE_ERRORS:
            return []  # as a single proof there
        raise StoreError(f"{folder} cannot be read: {error.strerror or error}") from error
    names = sorted(name for name in files if name.startswith(PREFIX) and name.endswith(".json"))
    found = [cached_bodies(folder, name[len(PREFIX) : -len(".json")]) for name in names]
    return [record for record in found if record is not None]
