"""Reading the files of users' elements into a config, so that it needs no other file."""

from pathlib import Path as FilePath
from typing import Any

from rbstab.config.errors import ConfigProblem
from rbstab.config.source import BYTE_ORDER_MARK, Path, Source, key_of
from rbstab.config.user_code.section import KIND
from rbstab.elements.user_code.declared import MAX_SOURCE, sha256
from rbstab.files.regular_file import open_regular


def embed_files(source: Source) -> None:
    """Put the text of each element's file, its name and its SHA-256 into the data of a config.

    An element that has its `source` already stays as it is: its file may have changed since.

    Args:
        source: The config; a file that cannot be read becomes one of its problems.
    """
    elements = source.data.get("elements") if isinstance(source.data, dict) else None
    for name, element in elements.items() if isinstance(elements, dict) else ():
        if not isinstance(element, dict) or element.get("kind") != KIND or "source" in element:
            continue
        file = element.get("file")
        if isinstance(file, str) and file:
            _embed(source, ("elements", name), element, source.folder / file)


def _embed(source: Source, path: Path, element: dict[str, Any], file: FilePath) -> None:
    where = source.location((*path, "file"))
    # A problem of the text is one of the file's name, as the config has no other place for it.
    source.values[*path, "source"] = where
    try:
        text = read_python(file)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        problem = f"is {file}, which cannot be read: {reason}"
        expected = "expected a Python file, relative to the config"
        source.problems.append(ConfigProblem(where, key_of((*path, "file")), problem, expected))
        return
    element |= {"file": file.name, "source": text}
    element.setdefault("sha256", sha256(text))


def read_python(file: FilePath) -> str:
    """Return the text of a Python file, with a line feed as the end of each line.

    Raises:
        OSError: It cannot be read.
        ValueError: It is not text in UTF-8, or too long.
    """
    with open_regular(file) as opened:
        raw = opened.read(4 * MAX_SOURCE + 1)
    try:
        text = raw.decode().removeprefix(BYTE_ORDER_MARK)
    except UnicodeDecodeError as error:
        raise ValueError("it is not text in UTF-8") from error
    if len(text) > MAX_SOURCE:
        raise ValueError(f"it has more than {MAX_SOURCE} characters")
    # The same file has one digest on every system.
    return text.replace("\r\n", "\n").replace("\r", "\n")
