"""Reading the CSV files of tables: their numbers take the place of the file in the data.

So a config holds all its numbers, and neither its identity nor a stored run depends on a file.
"""

import csv
import hashlib
import math
from dataclasses import replace
from typing import Any

from rbstab.config.errors import ConfigProblem, Location
from rbstab.config.inputs.signals import MAX_ROWS
from rbstab.config.messages import describe
from rbstab.config.source import BYTE_ORDER_MARK, MAX_FILE_SIZE, Path, Source, key_of
from rbstab.files.regular_file import open_regular

COLUMNS = 2
"""A row of a table: a time, s, and a value."""

MAX_REPORTED = 10
"""The most wrong rows of a table that are reported one by one; the others are counted."""

_EXPECTED = "expected a CSV file of times, s, and values"


def read_tables(source: Source) -> list[ConfigProblem]:
    """Replace the file of each table in a source by its numbers, and return what is wrong."""
    problems: list[ConfigProblem] = []
    elements = source.data.get("elements")
    for name, element in elements.items() if isinstance(elements, dict) else ():
        signal = element.get("signal") if isinstance(element, dict) else None
        if not isinstance(signal, dict) or signal.get("kind") != "table":
            continue
        # A wrong file name, or numbers beside a file, are for the schema to reject.
        if isinstance(signal.get("file"), str) and not signal.keys() & {"times", "values"}:
            problems += _read(source, signal, ("elements", name, "signal", "file"))
    return problems


def _read(source: Source, signal: dict[str, Any], path: Path) -> list[ConfigProblem]:
    file, key, where = source.folder / signal["file"], key_of(path), source.location(path)
    try:
        with open_regular(file) as opened:
            raw = opened.read(MAX_FILE_SIZE + 1)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        found = f"is {describe(signal['file'])}, which cannot be read: {reason}"
        return [ConfigProblem(where, key, found, f"{_EXPECTED}, beside the config")]
    if len(raw) > MAX_FILE_SIZE:
        return [ConfigProblem(Location(str(file)), key, "is larger than 1 MiB", _EXPECTED)]
    try:
        text = raw.decode().removeprefix(BYTE_ORDER_MARK)
    except UnicodeDecodeError:
        return [ConfigProblem(Location(str(file)), key, "is not text", f"{_EXPECTED}, in UTF-8")]
    rows, problems = _rows(text, str(file), key)
    if not problems:
        signal["times"], signal["values"] = [t for t, _ in rows], [value for _, value in rows]
        signal["source"] = f"{file.name[:100]}, SHA-256 {hashlib.sha256(raw).hexdigest()}"
        del signal["file"]
    return problems


def _rows(text: str, name: str, key: str) -> tuple[list[tuple[float, float]], list[ConfigProblem]]:
    """Return the rows of a table, and its problems."""
    rows: list[tuple[float, float]] = []
    problems: list[ConfigProblem] = []

    def report(line: int, column: int, found: str, expected: str) -> None:
        problems.append(ConfigProblem(Location(name, line, column), key, found, expected))

    is_first = True
    for line, row in enumerate(csv.reader(text.splitlines()), start=1):
        entries = [entry.strip() for entry in row]
        if not any(entries) or entries[0].startswith("#"):
            continue
        numbers = [_number(entry) for entry in entries]
        if len(entries) != COLUMNS:
            columns = "1 column" if len(entries) == 1 else f"{len(entries)} columns"
            report(line, 1, f"has {columns}", "expected two: a time, s, then a comma and a value")
        elif None not in numbers:
            rows.append((numbers[0], numbers[1]))  # type: ignore[arg-type]
            if len(rows) > 1 and rows[-1][0] < rows[-2][0]:
                found = f"is the time {rows[-1][0]:g} s after {rows[-2][0]:g} s"
                report(line, 1, found, "expected times that do not fall")
        # The names of the columns may stand above them.
        elif not (is_first and numbers == [None, None]):
            index = numbers.index(None)
            column = 1 + sum(len(entry) + 1 for entry in row[:index])
            report(line, column, f"is {describe(entries[index])}", "expected a finite number")
        is_first = False
    if not rows and not problems:
        report(1, 1, "has no row of numbers", _EXPECTED)
    if len(rows) > MAX_ROWS:
        report(1, 1, f"has {len(rows)} rows", f"expected at most {MAX_ROWS}")
    return rows, _first_ones(problems)


def _first_ones(problems: list[ConfigProblem]) -> list[ConfigProblem]:
    """Return the first problems of a table, and one that counts the others."""
    more = len(problems) - MAX_REPORTED
    if more <= 1:
        return problems
    found = f"is the first of {more} more wrong rows"
    return [*problems[:MAX_REPORTED], replace(problems[MAX_REPORTED], problem=found, expected="")]


def _number(text: str) -> float | None:
    """Return a finite number; None if a text is none."""
    try:
        number = float(text)
    except ValueError:
        return None
    # Python reads 1_000 as a number.
    return number + 0.0 if math.isfinite(number) and "_" not in text else None
