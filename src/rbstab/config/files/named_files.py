"""Reading the files that a config names: their content takes the place of their names.

They are the Python files of users' elements, and the CSV files of tables. So a config needs no
other file, and neither its identity nor a stored run depends on one.
"""

import hashlib
import math
import re
from collections.abc import Iterator
from pathlib import Path as FilePath
from typing import Any

from rbstab.config.errors import ConfigProblem, Location
from rbstab.config.sections.signals import MAX_ROWS
from rbstab.config.source import Path, Source, key_of, read_text
from rbstab.config.user_code.section import KIND as PYTHON
from rbstab.elements.user_code.declared import MAX_SOURCE, sha256

COLUMNS = 2
"""A row of a table: a time, s, and a value."""

_CELL = re.compile(r"(?:^|,)\s*([^,]*)")

_TABLE = "expected a CSV file of times, s, and values"


def embed_files(source: Source) -> None:
    """Put the content of the files that the elements of a config name into its data.

    An element that has its content already stays as it is: its file may have changed since.

    Args:
        source: The config; what is wrong with a file becomes one of its problems.
    """
    elements = source.data.get("elements") if isinstance(source.data, dict) else None
    for name, element in elements.items() if isinstance(elements, dict) else ():
        if _names_file(element, PYTHON, {"source"}):
            _embed_python(source, ("elements", name, "file"), element)
        signal: Any = element.get("signal") if isinstance(element, dict) else None
        if _names_file(signal, "table", {"times", "values"}):
            _embed_table(source, ("elements", name, "signal", "file"), signal)


def _names_file(section: Any, kind: str, content: set[str]) -> bool:
    """Whether a section names a file in place of its content; the schema rejects what is wrong."""
    if not isinstance(section, dict) or section.get("kind") != kind or section.keys() & content:
        return False
    return isinstance(section.get("file"), str) and section["file"] != ""


def _embed_python(source: Source, path: Path, element: dict[str, Any]) -> None:
    # A problem of the text is one of the file's name, as the config has no other place for it.
    source.values[*path[:-1], "source"] = source.location(path)
    file = source.folder / element["file"]
    try:
        text = read_python(file)
    except (OSError, ValueError) as error:
        _note_unread(source, path, file, error, "expected a Python file, relative to the config")
    else:
        element |= {"file": file.name, "source": text}
        element.setdefault("sha256", sha256(text))


def _embed_table(source: Source, path: Path, signal: dict[str, Any]) -> None:
    file, rows = source.folder / signal.pop("file"), [(0.0, 0.0)]
    try:
        text = read_text(file)
    except (OSError, ValueError) as error:
        _note_unread(source, path, file, error, f"{_TABLE}, beside the config")
    else:
        rows, problems = _rows(text, str(file), key_of(path))
        source.problems += problems
        digest = hashlib.sha256(text.encode()).hexdigest()
        signal["source"] = f"{file.name[:100]}, SHA-256 {digest}"
    signal["times"], signal["values"] = [t for t, _ in rows], [value for _, value in rows]


def _note_unread(
    source: Source, path: Path, file: FilePath, error: Exception, expected: str
) -> None:
    reason = getattr(error, "strerror", None) or str(error)
    problem = f"is {file}, which cannot be read: {reason}"
    source.problems.append(source.problem(path, problem, expected))


def read_python(file: FilePath) -> str:
    """Return the text of a Python file, with a line feed as the end of each line.

    Raises:
        OSError: It cannot be read.
        ValueError: It is not text in UTF-8, or too long.
    """
    text = read_text(file, 4 * MAX_SOURCE)
    if len(text) > MAX_SOURCE:
        raise ValueError(f"it has more than {MAX_SOURCE} characters")
    # The same file has one digest on every system.
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _rows(text: str, name: str, key: str) -> tuple[list[tuple[float, float]], list[ConfigProblem]]:
    """Return the rows of a table, and its problems; a wrong table has one row of zeros."""
    rows: list[tuple[float, float]] = []
    problems: list[ConfigProblem] = []

    def report(line: int, problem: str, expected: str) -> None:
        problems.append(ConfigProblem(Location(name, line), key, problem, expected))

    is_first = True
    for line, cells in csv_rows(text):
        entries = [entry for _, entry in cells]
        numbers = [number for number in map(finite_number, entries) if number is not None]
        # The names of the columns may stand above them.
        if len(entries) != COLUMNS or (len(numbers) != COLUMNS and (numbers or not is_first)):
            problem = f"is {', '.join(entries)}"
            report(
                line, problem, "expected two finite numbers: a time, s, then a comma and a value"
            )
        elif numbers:
            rows.append((numbers[0], numbers[1]))
            if len(rows) > 1 and rows[-1][0] < rows[-2][0]:
                problem = f"is the time {rows[-1][0]:g} s after {rows[-2][0]:g} s"
                report(line, problem, "expected times that do not fall")
        is_first = False
    if not rows and not problems:
        report(1, "has no row of numbers", _TABLE)
    if len(rows) > MAX_ROWS:
        report(1, f"has {len(rows)} rows", f"expected at most {MAX_ROWS}")
    return [(0.0, 0.0)] if problems else rows, problems


def csv_rows(text: str) -> Iterator[tuple[int, list[tuple[int, str]]]]:
    """Yield the line and the cells of each row of a CSV file that is not empty and no comment.

    A cell is the column at which its text begins, and its text, without quotes around it.
    """
    for line, row in enumerate(text.splitlines(), start=1):
        cells = [(cell.start(1) + 1, cell[1].strip(' \t"')) for cell in _CELL.finditer(row)]
        if any(text for _, text in cells) and not cells[0][1].startswith("#"):
            yield line, cells


def finite_number(text: str) -> float | None:
    """Return a finite number; None if a text is none."""
    try:
        number = float(text)
    except ValueError:
        return None
    # Python reads 1_000 as a number.
    return number + 0.0 if math.isfinite(number) and "_" not in text else None
