"""Judge what a disturbed command has left: its messages and its files."""

import re
from pathlib import Path
from typing import NamedTuple

from faults.contents import Content, Folder, differences
from support.forked_commands import Ended

FORBIDDEN = (
    "Traceback",
    "Exception ignored",
    "unable to",
    "Unable to",
    "Can't",
    "errno = ",
    "[Errno",
    "exit code -",
    "the output cannot be written",
)
"""Texts of Python and HDF5 that no user may see, and a wrong one: only files of results fail."""

ALLOWED_CODES = (0, 4)

PICTURE = re.compile(r"_files/[^/]+\.svg$")
"""The end of the path of a picture of a report in Markdown."""


class Reference(NamedTuple):
    """An undisturbed run of a command: the folder before and after it.

    Args:
        template: The working folder before it.
        before: The files of `results` before it.
        after: The content of the files of `results` after it.
        digests: The digests of the files after it.
        ended: How it ended.
        prints: Whether it always prints the same.
        first: The content of files that a first part of the command leaves.
    """

    template: Path
    before: Folder
    after: dict[str, Content]
    digests: Folder
    ended: Ended
    prints: bool
    first: dict[str, Content]


def new_lines(reference, ended):
    """Return the number of lines on stderr that the undisturbed command does not print."""
    usual = reference.ended.stderr.splitlines()
    return sum(line not in usual for line in ended.stderr.splitlines())


def message_problems(reference, ended, most_lines):
    """Yield what is wrong with the exit code and the output.

    Args:
        reference: The undisturbed command.
        ended: How the command ended.
        most_lines: The most lines on stderr after an error.
    """
    more = new_lines(reference, ended)
    if ended.code not in ALLOWED_CODES:
        yield f"exit code {ended.code}"
    if ended.code != 0 and not 1 <= more <= most_lines:
        yield f"{more} lines on stderr"
    for word in FORBIDDEN:
        if word in ended.stderr or word in ended.stdout:
            yield f"prints {word!r}"


def file_problems(reference, files, contents, changing="-"):
    """Yield what is wrong with the files: lost earlier results, and wrong new ones.

    Args:
        reference: The undisturbed command.
        files: The files.
        contents: Their content.
        changing: The start of the names of files that may be new in another way. A new report that
            lacks a result also lacks its pictures (see `missing_pictures`).
    """
    before, after = reference.before, reference.digests
    for name, digest in before.items():
        if _is_hidden(name) or (name.startswith(changing) and PICTURE.search(name)):
            continue
        if after.get(name) == digest:
            if files.get(name) != digest:
                yield f"{name} was changed or lost"
        elif digest in after.values():
            if digest not in files.values():
                yield f"{name} was to be moved aside, and is lost"
        elif name in reference.after and name not in files:
            moved = digest in files.values()
            yield f"{name} was moved, but not replaced" if moved else f"{name} is lost"
    earlier = set(before.values())
    for name, digest in files.items():
        if _is_hidden(name) or digest in earlier or name.startswith(changing):
            continue
        expected = reference.after.get(name)
        if expected is None:
            yield f"{name} is unexpected"
        elif contents[name] not in (expected, reference.first.get(name)):
            wrong = ", ".join(differences(contents[name], expected)[:5])
            yield f"{name} is wrong: {wrong}"


def unfinished(reference, contents, optional="-"):
    """Yield the files of the undisturbed run that are missing or different.

    Args:
        reference: The undisturbed command.
        contents: The content of the files.
        optional: The start of the names of files that may be missing.
    """
    for name, expected in reference.after.items():
        if _is_hidden(name) or (name.startswith(optional) and name not in contents):
            continue
        if name not in contents:
            yield f"{name} is missing, but the exit code is 0"
        elif contents[name] != expected:
            wrong = ", ".join(differences(contents[name], expected)[:5])
            yield f"{name} is not that of an undisturbed run, but the exit code is 0: {wrong}"


def _is_hidden(name):
    return Path(name).name.startswith(".")
