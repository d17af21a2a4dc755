"""Cache of proofs in a folder of results.

All runs with the same body, gravity and controller share one proof.
"""

import errno
import json
import os
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from rbstab.config.schema import Config
from rbstab.files.paths import exists
from rbstab.integrate.problem import Problem
from rbstab.store.disk.paths import identity_of
from rbstab.store.document import Model, read_model, write_document
from rbstab.store.errors import NotAResultError, StoreError

if TYPE_CHECKING:
    from rbstab.experiment.stored_proof.proof import Proof

PROOFS = "proofs"
"""The name of the folder of proofs in a folder of results."""

WITHIN_TOLERANCES = ("within-", "starts-")
"""The beginnings of the names of proofs for all bodies, or for all starts, within tolerances."""

BOUND = "bound-"
"""The beginning of the names of proofs of bounds on disturbances."""

MAX_KEPT = 64
"""The most proofs that a process keeps."""

NO_FILE_ERRORS = (
    *(errno.ENOENT, errno.ENOTDIR, errno.EISDIR, errno.EINVAL),
    *(errno.EACCES, errno.EPERM, errno.ELOOP, errno.ENAMETOOLONG),
)
"""Errors of opening a path at which there is no file that can be read. Then there is no proof."""


def proof_file(folder: Path, config: Config) -> Path:
    """Return the file of a config's proof in a folder of results."""
    from rbstab.experiment.stored_proof.identity import proof_id

    return folder / PROOFS / f"{proof_id(config)}.json"


def cached_proof(folder: Path, config: Config) -> "Proof | None":
    """Return the cached proof of a config in a folder of results; None if it is missing.

    A damaged file, and one of an older program, is treated as missing.

    Raises:
        StoreError: The disk reports an error; the proof may be whole.
    """
    if not _may_hold_proofs(folder):
        return None
    file = proof_file(folder, config)
    proof = _read(file)
    # The name of the file is the id.
    return proof.of(config) if proof is not None and proof.id == file.stem else None


def _may_hold_proofs(folder: Path) -> bool:
    """Whether a folder of results has a folder of proofs, or it is not known."""
    # Most folders have none. Then the modules of proofs need not be imported, which takes longer
    # than all else that a short run does besides its integration.
    try:
        (folder / PROOFS).stat()
    except (FileNotFoundError, NotADirectoryError):
        return False
    except (OSError, ValueError):
        return True  # reading the proof tells the error
    return True


def _read(file: Path) -> "Proof | None":
    """Read a proof; None if it is missing or damaged. It is read once, until its file changes."""
    try:
        # A proof appears by a rename, so a new one is another file.
        return _read_once(file, identity_of(file.stat()))
    except (OSError, ValueError):
        return _read_once.__wrapped__(file, ())  # reading it tells the error


@lru_cache(MAX_KEPT)
def _read_once(file: Path, _identity: tuple[int, ...]) -> "Proof | None":
    """Read a proof, once for each device, inode, size and times of its file."""
    from rbstab.experiment.stored_proof.proof import Proof

    return stored_model(file, Proof)


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


def sufficient_proof(folder: Path, config: Config, *, brief: bool) -> "Proof | None":
    """Return the cached proof of a config if it need not be made again; None otherwise.

    Args:
        folder: The folder of results.
        config: The config.
        brief: Whether a proof that ended early will do.

    Raises:
        StoreError: The disk fails to read it.
    """
    proof = cached_proof(folder, config)
    return proof if proof is not None and (brief or not proof.brief) else None


def why_unreadable(folder: Path) -> str:
    """Return why the proofs in a folder of results cannot be read; empty if they can be.

    A folder that may be entered but not listed, or listed but not entered, counts as unreadable.

    Args:
        folder: The folder of results.
    """
    proofs = folder / PROOFS
    try:
        with os.scandir(proofs) as files:
            next(files, None)
        exists(proofs / PROOFS)
    except FileNotFoundError:
        return ""
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        return f"the stored proofs in {proofs} cannot be read: {reason}"
    return ""


OLDER = "stored proof of an older program, made again"
"""What is said where `is_older`."""


def is_older(folder: Path, config: Config) -> bool:
    """Return whether the stored proof of a config is one of an older program."""
    from rbstab.experiment.stored_proof.identity import PROOF_VERSION

    try:
        data = json.loads(proof_file(folder, config).read_bytes())
    except (OSError, ValueError):
        return False
    return isinstance(data, dict) and data.get("version") != PROOF_VERSION


def proof_for(
    folder: Path, config: Config, problem: Problem | None = None, *, brief: bool = False
) -> "Proof":
    """Return the cached proof of a config; if there is none, make it and write it to the cache.

    Args:
        folder: The folder of results.
        config: The config.
        problem: Its problem, if it is built already.
        brief: Whether a brief proof will do, as in `prove`. If it will not, a cached proof that
            ended early is made again, without that limit.

    Raises:
        StoreError: The proof cannot be written, or the disk fails to read it.
    """
    from rbstab.experiment.proof import prove

    cached = sufficient_proof(folder, config, brief=brief)
    if cached is not None:
        return cached
    made = prove(config, problem, brief=brief)
    if made.brief:
        # Another process may have stored a proof in the meantime that did not end early.
        cached = cached_proof(folder, config)
        if cached is not None:
            return cached
    write_document(proof_file(folder, config), made.model_dump(mode="json"))
    return made
