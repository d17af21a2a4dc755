"""Counts, lists and untrusted texts as plain text that is safe to show anywhere."""

import re
from collections.abc import Iterable

from rbstab.files.text import grouped, printable

MAX_LENGTH = 1000
"""Maximum length of an untrusted text in a report; texts of a config are no longer than this."""

_UNIT = r"(?:[kcmµ]?[mNJWs]|kg|Hz|rad|deg|%)(?:[²³]|\^-?\d)?"
_UNITS = rf"{_UNIT}(?:[ /]{_UNIT})*"

_WHOLE = re.compile(
    # A number, or numbers in parentheses, with a unit; a unit in brackets.
    rf"(?<=[\d)]) {_UNITS}(?![\w/])|\[(?:1/)?{_UNITS}\]"
    # What a number or a short symbol is equal to, or compared with: "= 20", "t = ", "v(0) < ".
    r"|(?<=[=<>≤≥≈]) (?=[-+±(]?[\dπ])"
    r"|(?<![^\s(])\(?[^\W\d_]\d?(?:\(\w\))? [=<>≤≥≈](?= )"
)
"""What stays on one line."""

_HINT = re.compile(r"[\d)] |[=<>≤≥≈[]")
"""A text without this has nothing of it; most entries of tables are such texts."""


def untrusted(text: object, max_length: int = MAX_LENGTH) -> str:
    """Make a text of untrusted origin printable on one line, and cut it if it is too long.

    Characters that control a terminal or change the direction of writing are escaped.
    """
    whole = str(text)
    if len(whole) <= max_length and whole.isascii() and whole.isprintable():
        return whole  # as most texts are; the rest takes much longer
    shown = printable(whole[: max_length + 1])
    return shown if len(shown) <= max_length else f"{shown[: max_length - 1]}…"


def with_unit(label: str, unit: str) -> str:
    """Return a label with its unit in brackets; "" and "1" are those of a pure number."""
    return label if unit in ("", "1") else f"{label} [{unit}]"


def counted(count: int, singular: str, plural: str = "") -> str:
    """Format a count with its noun: "1 run", "2 runs", "10,000 runs".

    Args:
        count: The count.
        singular: The noun for a count of one.
        plural: The noun for other counts, if it is not the singular with an s.
    """
    return f"{grouped(count)} {singular if count == 1 else plural or f'{singular}s'}"


def listed(words: Iterable[str], max_items: int = 6, last: str = ", ") -> str:
    """Join the first words by commas, and add the number of the omitted ones.

    If none is omitted, the last two are joined by `last`, such as " and ".

    Args:
        words: The words.
        max_items: The most words that are shown.
        last: What stands between the last two.
    """
    every = list(words)
    if len(every) > max_items:
        return f"{', '.join(every[:max_items])} and {grouped(len(every) - max_items)} more"
    return last.join([part for part in (", ".join(every[:-1]), *every[-1:]) if part])


def unbroken(text: str) -> str:
    """Keep a number with its unit on one line, by spaces that do not break: "20 N m", "t = 4 s"."""
    if _HINT.search(text) is None:
        return text
    return _WHOLE.sub(lambda match: match[0].replace(" ", "\u00a0"), text)
