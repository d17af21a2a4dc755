"""Reading the file of a proof of any kind, and what it says."""

from pathlib import Path
from typing import NamedTuple

from rbstab.experiment.robust.record import BodiesRecord
from rbstab.experiment.robust.sentences import within_sentences
from rbstab.experiment.stability import statements_of
from rbstab.experiment.start_sets.starts_record import StartsProof
from rbstab.experiment.stored_proof.proof import Proof
from rbstab.store.document import read_model


class Said(NamedTuple):
    """What a proof says.

    Attributes:
        kind: What it is a proof of.
        sentences: Its statements.
        id: The checksum of what it is about.
        seconds: The time that it took, s.
    """

    kind: str
    sentences: list[str]
    id: str
    seconds: float


def what_it_says(path: Path) -> Said:
    """Return what a proof of any kind says; the kind is told by the name of its file.

    Raises:
        StoreError: The file cannot be read, or is no proof.
    """
    kind, _, _ = path.stem.rpartition("-")
    if kind == "within":
        bodies = read_model(path, BodiesRecord)
        texts = [f"{t.key}={t.low}..{t.high}" for t in bodies.tolerances]
        sentences = within_sentences(texts, bodies)
        return Said("proof for all bodies within tolerances", sentences, bodies.id, bodies.seconds)
    if kind == "starts":
        starts = read_model(path, StartsProof)
        sentences = [f"{starts.sentence}."]
        return Said("proof for all starts within tolerances", sentences, starts.id, starts.seconds)
    proof = read_model(path, Proof)
    what = "proof of rest states and their regions"
    return Said(what, statements_of(proof), proof.id, proof.seconds)
