"""Proofs of stored runs, which are made once and then stored beside copies of the runs."""

from functools import cache
from pathlib import Path

from rbstab.experiment.proof import prove
from rbstab.experiment.proof_cache import proof_file
from rbstab.experiment.stored_config import stored_config
from rbstab.experiment.stored_proof.proof import Proof
from rbstab.store.document import write_document
from rbstab.store.run_file import open_result


@cache
def _proof_of(run: Path) -> Proof:
    config = stored_config(open_result(run)).config
    assert config is not None
    return prove(config)


def store_proof_of(run: Path, folder: Path) -> Path:
    """Store a proof of the config of a stored run in a folder of results; return its file."""
    config = stored_config(open_result(run)).config
    assert config is not None
    path = proof_file(folder, config)
    path.parent.mkdir(exist_ok=True)
    write_document(path, _proof_of(run.resolve()).model_dump(mode="json"))
    return path
