"""Paths as words of a shell command, for messages that name the next command."""

import shlex
from os import PathLike, fspath


def shell_word(path: str | PathLike[str]) -> str:
    """Quote a path for a shell; a leading dash gets `./`, so that it is not read as an option."""
    name = fspath(path)
    return shlex.quote(f"./{name}" if name.startswith("-") else name)
