"""Cache of proofs in a folder of results.

All runs with the same body, gravity and controller share one proof.
"""

import errno
from pathlib import Path

from rbstab.config.schema import Config
from rbstab.experiment.proof import PROOF_VERSION, Proof, proof_id, prove
from rbstab.integrate.problem import Problem
from rbstab.store.document import Model, read_model, write_document
from rbstab.store.errors import NotAResultError, StoreError

NO_FILE_ERRORS = (
    *(errno.ENOENT, errno.ENOTDIR, errno.EISDIR, errno.EINVAL),
    *(errno.EACCES, errno.EPERM, errno.ELOOP, errno.ENAMETOOLONG),
)
"""Errors of opening a path at which there is no file that can be read. Then there is no proof."""


def proof_file(folder: Path, config: Config, version: int = PROOF_VERSION) -> Path:
    """Return the file of a config's proof in a folder of results."""
    return folder / "proofs" / f"{proof_id(config, version)}.json"


def cached_proof(folder: Path, config: Config) -> Proof | None:
    """Return the cached proof of a config in a folder of results; None if it is missing.

    A proof of an older version is returned if there is no newer one. A damaged file is treated as
    missing.

    Raises:
        StoreError: The disk reports an error; the proof may be whole.
    """
    for version in range(PROOF_VERSION, 0, -1):
        found = _cached(folder, config, version)
        if found is not None:
            return found
    return None


def _cached(folder: Path, config: Config, version: int) -> Proof | None:
    """Return the cached proof of one version."""
    proof = stored_model(proof_file(folder, config, version), Proof)
    return proof if proof is not None and proof.id == proof_id(config, version) else None


def stored_model(file: Path, model: type[Model]) -> Model | None:
    """Read a stored proof of any kind; None if it is missing or damaged.

    Raises:
        StoreError: The disk reports an error; the proof may be whole.
    """
    try:
        return read_model(file, model)
    except NotAResultError:
        return None
    except StoreError as error:
        if isinstance(error.__cause__, OSError) and error.__cause__.errno not in NO_FILE_ERRORS:
            raise
        return None


def proof_for(folder: Path, config: Config, problem: Problem | None = None) -> Proof:
    """Return the cached proof of a config; if there is none, make it and write it to the cache.

    A proof of an older version stays in the cache, and a new one is made beside it.

    Raises:
        StoreError: The proof cannot be written, or the disk fails to read it.
    """
    found = _cached(folder, config, PROOF_VERSION)
    if found is None:
        found = prove(config, problem)
        write_document(proof_file(folder, config), found.model_dump(mode="json"))
    return found
