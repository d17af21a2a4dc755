"""Stored proofs: what the file of a proof of any kind says, and those in a folder of results."""

from collections import defaultdict
from pathlib import Path
from typing import NamedTuple

from rbstab.experiment.disturbed.prove_bound import stated_in
from rbstab.experiment.disturbed.stored import StoredBound, bound_file
from rbstab.experiment.proof_cache import proof_file
from rbstab.experiment.robust.record import BodiesRecord
from rbstab.experiment.robust.sentences import within_sentences
from rbstab.experiment.stability import statements_of
from rbstab.experiment.start_sets.starts_record import StartsProof
from rbstab.experiment.stored_proof.proof import Proof
from rbstab.experiment.stored_run import stored_config
from rbstab.listing.folder import proofs_in, results_in
from rbstab.processes.mapped import mapped
from rbstab.report.model.words import listed
from rbstab.report.reading.kinds import Kind, kind_of
from rbstab.store.document import read_model
from rbstab.store.errors import StoreError
from rbstab.store.result import open_result

MAX_TITLES = 3
"""The most titles that are named beside a proof."""

SENTENCES = 2
"""As many sentences of a proof: its rest states, and whether all motions end in one."""


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
    if kind == "bound":
        stored = read_model(path, StoredBound)
        try:
            statements = stored.bound().statements
        except ValueError as error:
            statements = [f"It cannot be read: {error}."]
        return Said("proof of a bound on disturbances", statements, stored.id, stored.seconds)
    proof = read_model(path, Proof)
    what = "proof of rest states and their regions"
    return Said(what, statements_of(proof), proof.id, proof.seconds)


def proof_rows(results: Path) -> list[dict[str, str]]:
    """Return the proofs in a folder of results, each with the titles of the runs beside it.

    A proof that cannot be read has the reason in place of what it says.
    """
    titles = _titles_by_proof(results)
    rows = []
    for file in proofs_in(results):
        try:
            says = " ".join(what_it_says(file).sentences[:SENTENCES])
        except StoreError as error:
            says = str(error)
        of = listed(titles[file.name], MAX_TITLES) or "-"
        rows.append({"proof": file.name, "of": of, "says": says})
    return rows


def _titles_by_proof(folder: Path) -> dict[str, dict[str, None]]:
    """Return the titles of the runs in a folder by the names of the files of their proofs."""
    titles: defaultdict[str, dict[str, None]] = defaultdict(dict)
    runs = [path for path in results_in(folder) if kind_of(path) is Kind.RUN]
    for title, files in mapped(_proofs_of_run, runs):
        for file in files:
            titles[file.name][title] = None
    return titles


def _proofs_of_run(path: Path) -> tuple[str, list[Path]]:
    """Return the title of a run, and the files that its proofs have."""
    try:
        result = open_result(path)
    except StoreError:
        return "", []
    config = stored_config(result).config
    files = [] if config is None else [proof_file(path.parent, config)]
    stated = None if config is None else stated_in(config)
    if config is not None and stated is not None:
        files.append(bound_file(path.parent, config, stated))
    return str(result.attributes["title"]), files
