"""Texts of any origin in a line of a terminal: names of files, titles, keys."""

from collections.abc import Iterable

MAX_TEXT = 200
"""Characters of a key, and of a problem, in a message. A file may have keys of any length."""


def readable_name(text: str) -> str:
    """Return a text in which the bytes of UTF-8 that Python could not decode are decoded.

    In the C locale without Python's UTF-8 mode, each byte of a name above 127 becomes a lone
    surrogate. Bytes that are not UTF-8 stay as they are.
    """
    if text.isascii():
        return text
    try:
        return text.encode("utf-8", "surrogateescape").decode("utf-8", "surrogateescape")
    except UnicodeEncodeError:
        # A surrogate that stands for no byte.
        return text


def shortened(text: str) -> str:
    """Return a text for a message, cut if it is long."""
    return text if len(text) <= MAX_TEXT else text[: MAX_TEXT - 3] + "..."


def printable(text: str) -> str:
    """Escape line breaks and control characters of an untrusted text; the result is one line.

    Names of files in it are made readable first.
    """
    shown = readable_name(text)
    if shown.isprintable():
        return shown
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in shown)


def line(kind: str, title: str, facts: Iterable[str]) -> str:
    """Return what the interpreter shows: `<rbstab.Result "A title": completed, 401 samples>`."""
    name = f' "{shortened(title)}"' if title else ""
    return printable(f"<rbstab.{kind}{name}: {', '.join(map(shortened, facts))}>")
