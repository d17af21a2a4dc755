"""Reading YAML as plain data, with the location of every key and value.

Only a subset of YAML is read: one document of mappings, lists and plain scalars. Scalars follow the
core schema of YAML 1.2, where `1e-9` is a number and `no` is text, unlike in YAML 1.1. Aliases,
anchors, tags and duplicate keys are errors.
"""

import codecs
import math
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path as FilePath
from typing import Any, NoReturn

import yaml
from yaml.reader import Reader

from rbstab.config.errors import (
    ConfigError,
    ConfigProblem,
    Location,
)
from rbstab.files.paths import open_regular

Path = tuple[str | int, ...]
"""The keys and list indices from the root of a document to a value."""

BYTE_ORDER_MARK = "\ufeff"

UTF_16_MARKS = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
"""The beginnings of files in UTF-16."""

MAX_FILE_SIZE = 1 << 20
"""Largest size of a file, bytes."""

HDF5 = b"\x89HDF\r\n\x1a\n"
"""The first bytes of an HDF5 file."""

YAML = (".yaml", ".yml")
"""Endings of YAML files."""

BEGIN = "`rbstab init` writes a first one, `rbstab examples` lists others"
"""What to do if there is no file with such a name."""

MAX_DEPTH = 16
"""Largest depth of nested mappings and lists."""

TOO_DEEP = "is nested too deeply", f"at most {MAX_DEPTH} levels"
"""The problem of a text with more levels, and what is expected."""

_INTEGER = re.compile(r"[-+]?[0-9]{1,18}")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_BY_WORD = {
    **dict.fromkeys(("", "~", "null")),
    "true": True,
    "false": False,
    ".nan": math.nan,
    ".inf": math.inf,
    "+.inf": math.inf,
    "-.inf": -math.inf,
}
_WORDS = {
    form: value for word, value in _BY_WORD.items() for form in (word, word.title(), word.upper())
} | {".NaN": math.nan}

_Loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


@dataclass
class Source:
    """The data of a document, with the location of each value and key.

    Attributes:
        data: The plain data.
        values: The locations of the values.
        keys: The locations of the keys.
        problems: The problems that do not stop the reader (aliases, tags, duplicate keys). They are
            reported together with the problems of the data.
        folder: The folder to which the names of files in the data are relative.
    """

    data: Any
    values: dict[Path, Location] = field(default_factory=dict)
    keys: dict[Path, Location] = field(default_factory=dict)
    problems: list[ConfigProblem] = field(default_factory=list)
    folder: FilePath = FilePath()

    def location(self, path: Path, *, of_key: bool = False) -> Location:
        """Return the location of a value or of its key; if missing, of its nearest parent."""
        table = self.keys if of_key else self.values
        while path and path not in table:
            table, path = self.values, path[:-1]
        return table[path]

    def problem(
        self, path: Path, problem: str, expected: str, *, of_key: bool = False
    ) -> ConfigProblem:
        """Return a problem at a value or, with `of_key`, at its key.

        Args:
            path: The path of the value.
            problem: What is wrong.
            expected: What was expected instead.
            of_key: Whether the problem is at the key.
        """
        return ConfigProblem(self.location(path, of_key=of_key), key_of(path), problem, expected)

    def new(self, problems: Iterable[ConfigProblem]) -> list[ConfigProblem]:
        """Return the problems that are not at the place of one of the text.

        An alias or a repeated key has a message; what stands in its place needs no second one.
        """
        places = {problem.location for problem in self.problems}
        return [problem for problem in problems if problem.location not in places]


def read_text(path: FilePath, limit: int = MAX_FILE_SIZE) -> str:
    """Return the text of a file of at most `limit` bytes, without a byte order mark.

    A file in UTF-16 has such a mark. The PowerShell of Windows writes
    `rbstab show --config > FILE` in this encoding.

    Raises:
        OSError: It is not a file, or cannot be read.
        ValueError: It is larger, a file of HDF5, or not text.
    """
    with open_regular(path) as file:
        raw = file.read(limit + 1)
    if raw.startswith(HDF5):
        raise ValueError("it is an HDF5 file, as results are: `rbstab show` prints it")
    if len(raw) > limit:
        raise ValueError(f"it has more than {limit} bytes")
    encoding = "utf-16" if raw.startswith(UTF_16_MARKS) else "utf-8"
    try:
        return raw.decode(encoding).removeprefix(BYTE_ORDER_MARK)
    except UnicodeDecodeError as error:
        line = raw[: error.start].count(b"\n") + 1
        raise ValueError(f"it is not text in {encoding.upper()} in line {line}") from error


def read_source(path: FilePath) -> Source:
    """Read a YAML file.

    Raises:
        ConfigError: It cannot be read (`read_text`), or is not YAML.
    """
    try:
        text = read_text(path)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        begin = f"; {BEGIN}" if isinstance(error, FileNotFoundError) else ""
        expected = f"expected a YAML file{begin}"
        raise ConfigError.at(Location(str(path)), f"cannot be read: {reason}", expected) from error
    source = parse_source(text, str(path))
    source.folder = path.parent
    return source


def parse_source(text: str, name: str, column_offset: int = 0, path: Path = ()) -> Source:
    """Read YAML text.

    Args:
        text: The text.
        name: The source name in locations.
        column_offset: Added to the columns of locations in the first line.
        path: Where the data stand in a document.

    Raises:
        ConfigError: The text is not YAML, or not in the subset.
    """
    reader = _Reader(name, column_offset, path)
    forbidden = Reader.NON_PRINTABLE.search(text)
    if forbidden is not None:
        # Checked here because libyaml gives the position of such a character in bytes.
        before = text[: forbidden.start()]
        where = reader.place(before.count("\n") + 1, len(before) - before.rfind("\n"))
        reader.stop(where, "has a character that YAML forbids", "text", path)
    try:
        reader.read(yaml.parse(text, Loader=_Loader))
    except yaml.MarkedYAMLError as error:
        where = reader.location(error.problem_mark or error.context_mark)
        reader.stop(where, error.problem or "is not YAML", "YAML", path)
    return reader.source


class _Reader:
    """A reader that builds plain data from YAML events, one value in another."""

    def __init__(self, name: str, column_offset: int, path: Path) -> None:
        self.name, self.column_offset, self.path = name, column_offset, path
        self.source = Source(None, {path: self.place(1, 1)})
        self.events: Iterator[Any] = iter(())

    def place(self, line: int, column: int) -> Location:
        """Return a location; lines and columns count from 1."""
        return Location(self.name, line, column + (self.column_offset if line == 1 else 0))

    def location(self, mark: Any) -> Location:
        """Return the location of a mark of the library."""
        return Location(self.name) if mark is None else self.place(mark.line + 1, mark.column + 1)

    def report(self, where: Location, problem: str, expected: str, path: Path) -> None:
        """Note a problem."""
        config_problem = ConfigProblem(where, key_of(path), problem, f"expected {expected}")
        self.source.problems.append(config_problem)

    def stop(self, where: Location, problem: str, expected: str, path: Path) -> NoReturn:
        """Raise an error of all problems, with one after which nothing can be read."""
        self.report(where, problem, expected, path)
        raise ConfigError(self.source.problems)

    def read(self, events: Iterator[Any]) -> None:
        """Read the only document of a stream."""
        self.events = events
        starts = (event for event in events if isinstance(event, yaml.DocumentStartEvent))
        for number, event in enumerate(starts):
            if number > 0:
                where = self.location(event.start_mark)
                self.stop(where, "starts a second document", "one document", self.path)
            self.source.data = self.value(next(events), self.path)

    def value(self, event: Any, path: Path) -> Any:
        """Return the value that begins with an event."""
        where = self.source.values[path] = self.location(event.start_mark)
        if isinstance(event, yaml.AliasEvent):
            self.report(where, f"is the alias *{event.anchor}", "values written out", path)
            return None
        if event.tag is not None and event.tag != "!":
            self.report(where, f"has the tag {event.tag}", "no tags", path)
        if event.anchor is not None:
            self.report(where, f"has the anchor &{event.anchor}", "no anchors", path)
        if isinstance(event, yaml.ScalarEvent):
            return _plain_scalar(event.value) if event.implicit[0] else event.value
        if len(path) >= MAX_DEPTH:
            self.stop(where, *TOO_DEEP, path)
        if isinstance(event, yaml.MappingStartEvent):
            return self.items(path)
        entries: list[Any] = []
        while not isinstance(event := next(self.events), yaml.SequenceEndEvent):
            entries.append(self.value(event, (*path, len(entries))))
        return entries

    def items(self, path: Path) -> dict[str, Any]:
        """Return the mapping whose first event was read."""
        mapping: dict[str, Any] = {}
        while not isinstance(key := next(self.events), yaml.MappingEndEvent):
            where = self.location(key.start_mark)
            is_text = isinstance(key, yaml.ScalarEvent) and key.tag in (None, "!")
            if not is_text or key.anchor is not None:
                self.stop(where, "is a key that is no plain text", "text as a key", path)
            inner = (*path, key.value)
            if key.value in mapping:
                again = f"is given twice, first in line {self.source.keys[inner].line}"
                self.report(where, again, "each key once", inner)
                # Its value is read, and is at no path of the data.
                self.value(next(self.events), (*path, f"{key.value} (again)"))
            else:
                self.source.keys[inner] = where
                mapping[key.value] = self.value(next(self.events), inner)
        return mapping


def key_of(path: Path) -> str:
    """Return the text of a path in messages and on the command line: `controller.K_t[0]`."""
    text = ""
    for part in path:
        word = part if part != "" else "''"
        text += f"[{part}]" if isinstance(part, int) else f".{word}" if text else f"{word}"
    return text


def _plain_scalar(text: str) -> Any:
    if text in _WORDS:
        return _WORDS[text]
    if _INTEGER.fullmatch(text):
        return int(text)
    return float(text) if _FLOAT.fullmatch(text) else text
