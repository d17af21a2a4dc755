"""Numbers and foreign texts in words that can stand anywhere."""

import math
import shlex
from collections.abc import Iterable
from pathlib import Path

from rbstab.config.errors import printable

MAX_LENGTH = 1000
"""Characters of a foreign text that are shown: as many as the longest text of a config has."""

NOTHING = "-"
"""Stands where there is nothing to be said."""


def untrusted(text: object, longest: int = MAX_LENGTH) -> str:
    """A text that somebody else wrote, in one line, cut where it is too long.

    What could steer a terminal or turn the direction of writing is spelled out.
    """
    whole = str(text)
    shown = printable(whole[: longest + 1])
    return shown if len(shown) <= longest else f"{shown[: longest - 1]}…"


def number(value: float, digits: int = 4) -> str:
    """A number with so many significant digits; `NOTHING` for NaN."""
    return NOTHING if math.isnan(value) else f"{value:.{digits}g}"


def vector(values: Iterable[float], digits: int = 4) -> str:
    """Numbers in parentheses."""
    return f"({', '.join(number(value, digits) for value in values)})"


def counted(count: int, one: str, several: str = "") -> str:
    """A number of things: "1 run", "2 runs"."""
    return f"{count} {one if count == 1 else several or f'{one}s'}"


def listed(words: Iterable[str], most: int = 6) -> str:
    """Words in a row, and how many more there are."""
    every = list(words)
    more = f" and {len(every) - most} more" if len(every) > most else ""
    return ", ".join(every[:most]) + more


def shell_word(path: Path) -> str:
    """A path as a shell takes it; one that begins with a dash is not taken for an option."""
    name = str(path)
    return shlex.quote(f"./{name}" if name.startswith("-") else name)
