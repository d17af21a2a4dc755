"""Texts for people: counts, texts of any origin in one line, words of shell commands."""

import re
import shlex
import sys
from collections.abc import Iterable
from operator import index
from os import PathLike, fspath
from typing import SupportsIndex

FIRST_SEPARATED = 10_000
"""The smallest count with separators: four digits are read at a glance without one."""


def grouped(count: SupportsIndex) -> str:
    """Return a count with commas between thousands: "9999", "10,000", "1,048,576".

    Not for what programs read: numbers of members, commands, CSV and JSON.
    """
    whole = index(count)
    return f"{whole:,}" if abs(whole) >= FIRST_SEPARATED else str(whole)


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
    """Return what the interpreter shows: `<rbstab.Result "A title": completed, 401 samples>`.

    Args:
        kind: The name of the class.
        title: The title; "" for none.
        facts: What else is shown.
    """
    name = f' "{shortened(title)}"' if title else ""
    return printable(f"<rbstab.{kind}{name}: {', '.join(map(shortened, facts))}>")


_PLAIN_ON_WINDOWS = re.compile(r"[\w.:\\/+-]+")
"""Words that `cmd` and PowerShell take as they are."""

_BEFORE_QUOTE = re.compile(r'(\\+)(?="|$)')
"""Backslashes before a double quote, or before the one at the end of a word."""


def shell_word(path: str | PathLike[str]) -> str:
    """Quote a path for a shell; a leading dash gets `./`, so that it is not read as an option."""
    name = fspath(path)
    return quoted(f"./{name}" if name.startswith("-") else name)


def quoted(text: str) -> str:
    """Quote a text for a shell of this system.

    `cmd` of Windows does not know single quotes, and a backslash is no reason to quote there.
    """
    if sys.platform != "win32":
        return shlex.quote(readable_name(text))
    if _PLAIN_ON_WINDOWS.fullmatch(text):
        return text
    # No name of a file has a double quote there; in a title, a program reads \" as one. So it takes
    # two backslashes before a quote as one.
    return '"' + _BEFORE_QUOTE.sub(r"\1\1", text).replace('"', r"\"") + '"'


def chained_commands(first: str, second: str) -> str:
    """Return the text that says to run two commands.

    The PowerShell that comes with Windows does not know `&&`, and `cmd` does not know `;`.
    """
    return f"{first} && {second}" if sys.platform != "win32" else f"{first}, then {second}"
