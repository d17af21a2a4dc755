"""Keys of a config as users write them: `body.inertia[0]`, `initial.orientation.deg[1]`.

A key has one unit: SI, or degrees if it ends in `.deg`.
"""

import re
from math import radians
from typing import NamedTuple

from rbstab.config.source import Path, key_of
from rbstab.config.units import DEGREES
from rbstab.config.user_code.section import PARAMETERS

_KEY_PART = re.compile(r"([A-Za-z_][A-Za-z0-9_]*)|\[([0-9]{1,6})\]")


class NumberKey(NamedTuple):
    """A key as a user writes it: the path of its numbers, and whether it ends in `.deg`."""

    path: Path
    degrees: bool = False

    @property
    def text(self) -> str:
        """The key as it is written."""
        names = names_in(self.path)
        return key_of((*names, DEGREES, *self.path[len(names) :]) if self.degrees else self.path)

    @property
    def factor(self) -> float:
        """The SI value of a number 1 at this key."""
        return radians(1.0) if self.degrees else 1.0


def in_degrees(key: NumberKey) -> tuple[str, str]:
    """Return what is wrong with a key in radians of a value that is in degrees, and what to write.

    Without the refusal, 90 for a rate of 90 degrees per second would mean 90 rad/s.
    """
    right = key._replace(degrees=True).text
    return "is in radians, but the config gives degrees", f"expected {right}"


def number_key(text: str) -> NumberKey | None:
    """Return what a text says as a key, or None if it is not a key."""
    path = parse_key(text)
    if path is None:
        return None
    names = names_in(path)
    # A gain of a user may have this name.
    if len(names) < 3 or names[-1] != DEGREES or names[-2] == PARAMETERS:
        return NumberKey(path)
    return NumberKey((*names[:-1], *path[len(names) :]), degrees=True)


def parse_key(text: str) -> Path | None:
    """Return the path of a dotted key (the inverse of `key_of`), or None if it is not a key."""
    path: list[str | int] = []
    for match in _KEY_PART.finditer(text):
        word, index = match.groups()
        path.append(word if word is not None else int(index))
    return tuple(path) if path and key_of(tuple(path)) == text else None


def names_in(path: Path) -> Path:
    """Return a path without the indices at its end."""
    return tuple(part for part in path if isinstance(part, str))
