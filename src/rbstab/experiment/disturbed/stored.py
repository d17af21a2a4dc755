"""The proofs of bounds on disturbances that are stored beside those of rest states."""

import time
from dataclasses import replace
from pathlib import Path
from typing import Any

from pydantic import NonNegativeFloat, NonNegativeInt

from rbstab.config.build import supplies_power
from rbstab.config.schema import Config
from rbstab.experiment.disturbed.bound import Bound
from rbstab.experiment.disturbed.prove_bound import prove_bound, stated_in, with_start
from rbstab.experiment.proof_cache import BOUND, PROOFS, stored_model
from rbstab.experiment.stored_proof.identity import digest_of, proof_id
from rbstab.proof.disturbed.record import Stated, read_claim, read_stated, reading
from rbstab.proof.entries import Entry
from rbstab.proof.record import WrongRecordError
from rbstab.store.document import write_document


class StoredBound(Entry):
    """What is proved of all disturbances below bounds, without a start; `bound-` begins its file.

    claim is what the checker reads (`rbstab.proof.disturbed.record`). If it is not proved, outcome
    says why, and the claim only what it is about; else outcome is empty.
    """

    id: str
    without_inputs: bool
    outcome: str
    boxes: NonNegativeInt
    seconds: NonNegativeFloat
    claim: dict[str, Any]

    def bound(self, config: Config | None = None) -> Bound:
        """Return it as an answer, with what it says of the start of a config.

        Raises:
            WrongRecordError: This version of the program cannot read it.
        """
        given, tilt = read_stated(self.claim)
        answer = Bound(tuple(given), tuple(given.values()), tilt, self.outcome, self.boxes)
        answer = replace(answer, without_inputs=self.without_inputs)
        if self.claims_nothing:
            return answer
        forms, claim = read_claim(self.claim)
        answer = replace(answer, record=self.claim, claim=claim)
        if config is None:
            return answer
        with reading():  # parts of the claim may fit neither the body nor each other
            return with_start(answer, config, forms)

    @property
    def claims_nothing(self) -> bool:
        """Whether it only says why nothing is proved."""
        return bool(self.outcome)


def bound_id(config: Config, stated: Stated) -> str:
    """Return the identity of a proof: a digest of the body, the equations, and what is stated."""
    aim = None if config.desired is None else config.desired.orientation
    return digest_of([proof_id(config), stated.record, aim])


def bound_file(folder: Path, config: Config, stated: Stated) -> Path:
    """Return the file of a proof.

    Args:
        folder: The folder of results.
        config: The config.
        stated: What the proof is about.
    """
    return folder / PROOFS / f"{BOUND}{bound_id(config, stated)}.json"


def kept_bound(folder: Path, config: Config, stated: Stated | None = None) -> Bound | None:
    """Return the stored proof of what a config states; None if it is missing or damaged.

    Args:
        folder: The folder of results.
        config: The config.
        stated: What is stated in place of the section of the config.

    Raises:
        StoreError: The disk reports an error; the proof may be whole.
    """
    stated = stated or stated_in(config)
    if stated is None:
        return None
    file = bound_file(folder, config, stated)
    stored = stored_model(file, StoredBound)
    try:
        same = stored is not None and f"{BOUND}{stored.id}" == file.stem
        about = stored is not None and same and read_stated(stored.claim) == stated
        return stored.bound(config) if stored is not None and about else None
    except WrongRecordError:
        return None


def bound_for(folder: Path, config: Config, stated: Stated | None = None) -> Bound | None:
    """Return the stored proof of a bound; if there is none, make it and store it.

    Args:
        folder: The folder of results.
        config: The config.
        stated: As of `kept_bound`; without both, nothing is proved.

    Raises:
        StoreError: The proof cannot be written, or the disk fails to read it.
    """
    stated = stated or stated_in(config)
    kept = kept_bound(folder, config, stated)
    if kept is not None or stated is None:
        return kept
    begin = time.perf_counter()
    made = prove_bound(config, stated.given, stated.tilt)
    record = StoredBound(
        id=bound_id(config, stated),
        without_inputs=supplies_power(config),
        outcome=made.why,
        boxes=made.boxes,
        seconds=time.perf_counter() - begin,
        claim=made.record or stated.record,
    )
    write_document(bound_file(folder, config, stated), record.model_dump(mode="json"))
    return made
