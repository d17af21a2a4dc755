"""A proof for all bodies within tolerances, as plain data."""

from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, NonNegativeFloat, NonNegativeInt

from rbstab.experiment.answers.reasons import Reason

Triple = tuple[float, float, float]


class _Model(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class StoredTolerance(_Model):
    """The bounds of one number of a config, both included, as exact decimals.

    key is its key, such as `controller.K_r[0]`.
    """

    key: str
    low: str
    high: str


class BodiesRecord(_Model):
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

    id: str
    version: int
    outcome: str
    proved: bool | None
    level: NonNegativeFloat
    parts: NonNegativeInt
    boxes: NonNegativeInt
    why: Reason
    seconds: float
    sections: dict[str, Any]
    tolerances: tuple[StoredTolerance, ...]
    body: dict[str, str] | None = None
    rest_states: tuple[Triple, ...] = ()
    widest: str | None = None
    brief: Literal[True] | None = None
