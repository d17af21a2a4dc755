"""Paths and texts as words of a shell command, for messages that name the next command."""

import re
import shlex
import sys
from os import PathLike, fspath

from rbstab.files.names import readable_name

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
