"""Proofs within tolerances as plain data: for all bodies, or all starts; and their files."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any, ClassVar, Literal, Self

from pydantic import NonNegativeFloat, NonNegativeInt, PositiveInt

from rbstab.config.tolerances import Tolerance
from rbstab.experiment.proof_cache import PROOFS, stored_model
from rbstab.proof.entries import Entry, Triple
from rbstab.store.document import write_document


class StoredTolerance(Entry):
    """The bounds of one number of a config, both included, as exact decimals.

    key is its key, such as `controller.K_r[0]`.
    """

    key: str
    low: str
    high: str


def bounds_of(tolerances: Iterable[Tolerance]) -> tuple[StoredTolerance, ...]:
    """Return tolerances as plain data."""
    return tuple(
        StoredTolerance(key=tolerance.entry.key, low=tolerance.bounds[0], high=tolerance.bounds[1])
        for tolerance in tolerances
    )


class WithinRecord(Entry):
    """What all proofs within tolerances have; their files begin with `PREFIX`.

    tolerances has the bounds of numbers of a config, and why says why nothing is decided.
    """

    PREFIX: ClassVar[str]

    id: str
    version: PositiveInt
    tolerances: tuple[StoredTolerance, ...]
    why: str
    seconds: NonNegativeFloat

    @classmethod
    def file(cls, folder: Path, identity: str) -> Path:
        """Return the file of a proof in a folder of results."""
        return folder / PROOFS / f"{cls.PREFIX}{identity}.json"

    @classmethod
    def kept(cls, folder: Path, identity: str) -> Self | None:
        """Return a stored proof of this kind; None if it is missing or damaged.

        Raises:
            StoreError: The disk reports an error; the proof may be whole.
        """
        record = stored_model(cls.file(folder, identity), cls)
        return record if record is not None and record.id == identity else None

    def keep(self, folder: Path) -> None:
        """Store the proof in a folder of results.

        Raises:
            StoreError: The proof cannot be written.
        """
        write_document(self.file(folder, self.id), self.model_dump(mode="json"))


class BodiesRecord(WithinRecord):
    """What is proved for all bodies within tolerances.

    proved is True if each of them has exactly one rest state in the range of eq. 5, and it is a
    minimum; False if `body` shows that this is not so; None if it is not decided. outcome says how
    the proof ended, and why has details.

    level, J: each motion of each of these bodies with v(0) < level converges to the rest state of
    its body. It is 0 if that is not proved.

    parts is the number of boxes of bodies that were examined, boxes that of boxes of Θ. sections
    has body, gravity and controller of the config, and tolerances the bounds of its numbers.

    body has the numbers of a body that shows that the claim is false, as exact decimals by key, and
    rest_states are its proved rest states, Θ, rad.

    widest is the key of the number whose tolerance widens the bounds of the whole box most: if they
    decided nothing, both halves of its range may be decided. None if smaller tolerances would not
    help, if the box was proved whole, and in records of older versions.

    brief is True if it is not decided because a sweep asked, which examines fewer parts, or because
    of a limit of time: `rbstab stability --within` may decide more. None otherwise.
    """

    PREFIX = "within-"

    outcome: str
    proved: bool | None
    level: NonNegativeFloat
    parts: NonNegativeInt
    boxes: NonNegativeInt
    sections: dict[str, Any]
    body: dict[str, str] | None = None
    rest_states: tuple[Triple, ...] = ()
    widest: str | None = None
    brief: Literal[True] | None = None
