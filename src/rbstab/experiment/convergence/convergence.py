"""What is proved of the convergence of an exact motion: data, a sentence, and attributes."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum, StrEnum
from typing import Any

from rbstab.experiment.answers.rounded import rounded_down, rounded_up

METHOD_VERSION = 1
"""To be increased when a change of the method changes what it proves."""

PROVED, FALSE, NOT_DECIDED = "proved", "false", "not decided"

_WORDS = {True: PROVED, False: FALSE, None: NOT_DECIDED}

EVERY_START = "every start in the range converges"
"""What is said where the level of the region is infinite."""

ASK_FOR_PROOF = "rbstab run CONFIG --prove"
"""The command that makes a proof, and has no brief limits; CONFIG is the file of the config."""

NO_PROOF = f"no proof of the rest states is stored; {ASK_FOR_PROOF} tries to make it"

ATTRIBUTE = "convergence"
"""The attribute of a result that holds one of the three words; others begin with its name."""

Attributes = dict[str, str | int | float]


class Undecided(StrEnum):
    """Why convergence is not decided, in a word."""

    OUTSIDE = "outside"
    """The start is outside of every certified region, and the motion was not enclosed."""

    STEP_LIMIT = "step limit"
    """The enclosure reached its largest number of steps."""

    AT_REST = "at rest"
    """The energy has almost stopped falling, outside of every certified region."""

    NO_STEP = "no step"
    """No further step of the enclosure could be proved."""

    NO_REGION = "no region"
    """There is no proof of the rest states, or it has no certified region."""

    SLIDING = "sliding"
    """A connector or a tie slides, so the force jumps."""

    SWITCHES = "switches"
    """An element switches, so the motion is smooth only between its switches."""

    INPUT = "input"
    """An input supplies power, so v may rise."""

    USER_CODE = "user code"
    """An element is code of a user."""


class Enclose(IntEnum):
    """How far `simulate` encloses the exact motion: computes proved bounds on it, step by step.

    The exact motion is the true solution of the equations. The numbers are those in files.
    """

    NOTHING = 0
    """Not at all; only the initial state is compared with the certified regions."""

    UNTIL_PROVED = 1
    """Until convergence is proved."""

    TO_END = 2
    """Until convergence is proved, and to the end of the run."""

    BRIEFLY = 3
    """Until convergence is proved, but for a few seconds of computing at most."""

    def covers(self, other: "Enclose") -> bool:
        """Return whether an enclosure of this extent makes one of extent `other` unnecessary."""
        order = (0, 2, 3, 1)  # a brief one comes after nothing
        return order[self] >= order[other]


@dataclass(frozen=True, eq=False)
class Convergence:
    """What is proved of the exact motion from the start of a config.

    Args:
        proved: True: it converges to a rest state. False: there is none. None: not decided.
        rest_state: The number of that rest state, from 1 for the lowest.
        time: From this time on, s, it is in a region of proved convergence.
        energy: Bounds on v at that time, J: proved bounds on the energy, less the computed energy
            of the rest state.
        bound: The level of the region, J: every motion with a smaller v converges. It is infinite
            (null in JSON) where every start in the range converges.
        why: Why nothing is proved, and what would decide, or why the enclosure ended before it was
            to end; else empty.
        steps: The number of steps of the enclosure.
        seconds: The time that the enclosure took, s.
        enclosed: How far the exact motion was to be enclosed.
        reason: Why it is not decided, in a word; None if it is, or if it was read from a file.
    """

    proved: bool | None
    rest_state: int | None = None
    time: float | None = None
    energy: tuple[float, float] | None = None
    bound: float | None = None
    why: str = ""
    steps: int = 0
    seconds: float = 0.0
    enclosed: Enclose = Enclose.NOTHING
    reason: Undecided | None = None

    @property
    def word(self) -> str:
        """One of proved, false, not decided."""
        return _WORDS[self.proved]

    @property
    def sentence(self) -> str:
        """What is proved, in one sentence without a full stop."""
        if self.proved is None:
            return f"convergence is not decided: {self.why}"
        if self.energy is None or self.bound is None or self.time is None:
            return f"does not come to rest: proved; {self.why}"
        low, high = self.energy
        middle, spread = 0.5 * (low + high), 0.5 * (high - low)
        effort = f", {self.steps} steps, {self.seconds:.1f} s" if self.steps else ""
        why = f"; {self.why}" if self.why else ""
        if self.bound == math.inf:
            claim = f"converges to rest state {self.rest_state}: proved; {EVERY_START}"
            return f"{claim}{effort}{why}"
        values = (
            f"v = {middle:.6g} J < {rounded_down(self.bound)} J, error ≤ {rounded_up(spread, 1)} J"
        )
        begin = "from the start" if self.time == 0 else f"from t = {rounded_up(self.time)} s"
        return (
            f"converges to rest state {self.rest_state}: proved; "
            f"it is inside {self.region} {begin} ({values}){effort}{why}"
        )

    @property
    def region(self) -> str:
        """The name of the region that the motion enters, as `rbstab stability` prints it."""
        if self.rest_state is not None and self.rest_state > 1:
            return f"the region of rest state {self.rest_state}"
        return "the certified region"

    def as_data(self) -> dict[str, Any]:
        """Return the entries of its JSON."""
        return {
            "proved": self.proved,
            "time": self.time,
            "energy": None if self.energy is None else list(self.energy),
            "bound": None if self.bound == math.inf else self.bound,
            "rest_state": self.rest_state,
            "why": self.why,
            "steps": self.steps,
        }


def undecided(reason: Undecided, why: str) -> Convergence:
    """Return a convergence that is not decided."""
    return Convergence(None, why=why, reason=reason)


_ENTRIES = {
    "rest_state": int,
    "time": float,
    "energy_low": float,
    "energy_high": float,
    "bound": float,
    "reason": str,
    "steps": int,
    "wall_time": float,
    "method": int,
    "enclosed": int,
}
"""What a result stores of a convergence, besides the word; and the last four of an enclosure."""


def convergence_attributes(convergence: Convergence) -> Attributes:
    """Return a convergence as attributes of a result; what it lacks is left out."""
    low, high = convergence.energy or (None, None)
    values = [
        convergence.rest_state,
        convergence.time,
        low,
        high,
        convergence.bound,
        convergence.why or None,
    ]
    if convergence.enclosed:
        values += [
            convergence.steps,
            convergence.seconds,
            METHOD_VERSION,
            int(convergence.enclosed),
        ]
    stored = {
        f"{ATTRIBUTE}_{name}": value
        for name, value in zip(_ENTRIES, values, strict=False)
        if value is not None
    }
    return {ATTRIBUTE: convergence.word, **stored}


def stored_convergence(attributes: Mapping[str, Any]) -> Convergence | None:
    """Return the convergence in the attributes of a result; None if there is none.

    Raises:
        ValueError: An attribute is not what this program writes.
    """
    if ATTRIBUTE not in attributes:
        return None
    word = str(attributes[ATTRIBUTE])
    if word not in _WORDS.values():
        raise ValueError(f"{ATTRIBUTE} is {word!r}")
    names = {name: f"{ATTRIBUTE}_{name}" for name in _ENTRIES}
    given = {
        name: kind(attributes[names[name]])
        for name, kind in _ENTRIES.items()
        if names[name] in attributes
    }
    is_current = given.get("method") == METHOD_VERSION
    return Convergence(
        proved={text: proved for proved, text in _WORDS.items()}[word],
        rest_state=given.get("rest_state"),
        time=given.get("time"),
        energy=(given["energy_low"], given["energy_high"]) if "energy_high" in given else None,
        bound=given.get("bound"),
        why=given.get("reason", ""),
        steps=given.get("steps", 0),
        seconds=given.get("wall_time", 0.0),
        enclosed=Enclose(given.get("enclosed", 0) if is_current else 0),
    )
