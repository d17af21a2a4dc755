"""Cache of proofs in a folder of results.

All runs with the same body, gravity and controller share one proof.
"""

from contextlib import suppress
from pathlib import Path

from rbstab.config.schema import Config
from rbstab.experiment.proof import Proof, proof_id, prove
from rbstab.integrate.problem import Problem
from rbstab.store.document import read_model, write_document
from rbstab.store.errors import StoreError


def proof_file(folder: Path, config: Config) -> Path:
    """Return the file of a config's proof in a folder of results."""
    return folder / "proofs" / f"{proof_id(config)}.json"


def cached_proof(folder: Path, config: Config) -> Proof | None:
    """Return the cached proof of a config in a folder of results; None if it is missing.

    A damaged file, or a file of another version, is treated as missing.
    """
    with suppress(StoreError):
        proof = read_model(proof_file(folder, config), Proof)
        if proof.id == proof_id(config):
            return proof
    return None


def proof_for(folder: Path, config: Config, problem: Problem | None = None) -> Proof:
    """Return the cached proof of a config; if there is none, make it and write it to the cache.

    Raises:
        StoreError: The proof cannot be written.
    """
    found = cached_proof(folder, config)
    if found is None:
        found = prove(config, problem)
        write_document(proof_file(folder, config), found.model_dump(mode="json"))
    return found
