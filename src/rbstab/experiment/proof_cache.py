"""Cache of proofs in a folder of results.

All runs with the same body, gravity and controller share one proof.
"""

import errno
from pathlib import Path

from rbstab.config.schema import Config
from rbstab.experiment.proof import Proof, proof_id, prove
from rbstab.integrate.problem import Problem
from rbstab.store.document import read_model, write_document
from rbstab.store.errors import NotAResultError, StoreError

NO_FILE_ERRORS = (
    *(errno.ENOENT, errno.ENOTDIR, errno.EISDIR, errno.EINVAL),
    *(errno.EACCES, errno.EPERM, errno.ELOOP, errno.ENAMETOOLONG),
)
"""Errors of opening a path at which there is no file that can be read. Then there is no proof."""


def proof_file(folder: Path, config: Config) -> Path:
    """Return the file of a config's proof in a folder of results."""
    return folder / "proofs" / f"{proof_id(config)}.json"


def cached_proof(folder: Path, config: Config) -> Proof | None:
    """Return the cached proof of a config in a folder of results; None if it is missing.

    A damaged file, or a file of another version, is treated as missing.

    Raises:
        StoreError: The disk reports an error; the proof may be whole.
    """
    try:
        proof = read_model(proof_file(folder, config), Proof)
    except NotAResultError:
        return None
    except StoreError as error:
        if isinstance(error.__cause__, OSError) and error.__cause__.errno not in NO_FILE_ERRORS:
            raise
        return None
    return proof if proof.id == proof_id(config) else None


def proof_for(folder: Path, config: Config, problem: Problem | None = None) -> Proof:
    """Return the cached proof of a config; if there is none, make it and write it to the cache.

    Raises:
        StoreError: The proof cannot be written, or the disk fails to read it.
    """
    found = cached_proof(folder, config)
    if found is None:
        found = prove(config, problem)
        write_document(proof_file(folder, config), found.model_dump(mode="json"))
    return found
