"""Proofs within tolerances as plain data: for all bodies, or all starts; and their identities."""

import hashlib
import json
from collections.abc import Iterable
from typing import Any, ClassVar, Literal

from pydantic import BaseModel, ConfigDict, NonNegativeFloat, NonNegativeInt, PositiveInt

from rbstab.config.tolerances import Tolerance

Triple = tuple[float, float, float]


class Model(BaseModel):
    """Plain data that cannot be changed."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class StoredTolerance(Model):
    """The bounds of one number of a config, both included, as exact decimals.

    key is its key, such as `controller.K_r[0]`.
    """

    key: str
    low: str
    high: str


def bounds_of(tolerances: Iterable[Tolerance]) -> tuple[StoredTolerance, ...]:
    """Return tolerances as plain data."""
    return tuple(
        StoredTolerance(key=one.entry.key, low=one.bounds[0], high=one.bounds[1])
        for one in tolerances
    )


def digest_of(*parts: Any) -> str:
    """Return the identity of a proof: a digest of all that it depends on."""
    text = json.dumps(parts, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()[:32]


class WithinRecord(Model):
    """What all proofs within tolerances have; their files begin with `PREFIX`.

    tolerances has the bounds of numbers of a config, and why says why nothing is decided.
    """

    PREFIX: ClassVar[str]

    id: str
    version: PositiveInt
    tolerances: tuple[StoredTolerance, ...]
    why: str
    seconds: NonNegativeFloat


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
