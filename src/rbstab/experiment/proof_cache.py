"""Proofs kept beside the results, one for all runs that share body, gravity and controller."""

from contextlib import suppress
from pathlib import Path

from pydantic import ValidationError

from rbstab.config.schema import Config
from rbstab.experiment.proof import Proof, proof_id, prove
from rbstab.store.document import read_document, write_document
from rbstab.store.errors import StoreError


def proof_file(folder: Path, config: Config) -> Path:
    """Where the proof of a config is kept, in a folder of results."""
    return folder / "proofs" / f"{proof_id(config)}.json"


def cached_proof(folder: Path, config: Config) -> Proof | None:
    """The proof of a config that is kept in a folder of results, if there is one.

    A file that is damaged or that another version has written is none.
    """
    with suppress(StoreError, ValidationError):
        proof = Proof.model_validate(read_document(proof_file(folder, config)))
        if proof.id == proof_id(config):
            return proof
    return None


def proof_for(folder: Path, config: Config) -> Proof:
    """The proof of a config: the kept one, or one that is made now and kept.

    Raises:
        StoreError: It cannot be written.
    """
    found = cached_proof(folder, config)
    if found is None:
        found = prove(config)
        write_document(proof_file(folder, config), found.model_dump(mode="json"))
    return found
