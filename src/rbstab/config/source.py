"""Reading YAML as plain data, with the location of every key and value.

Only a subset of YAML is read: one document of mappings, lists and plain scalars. Scalars follow the
core schema of YAML 1.2, where `1e-9` is a number and `no` is text, unlike in YAML 1.1. Aliases,
anchors, tags and duplicate keys are errors.
"""

import codecs
import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path as FilePath
from typing import Any

import yaml
from yaml.reader import Reader

from rbstab.config.errors import (
    MAX_PROBLEMS,
    ConfigError,
    ConfigProblem,
    Location,
    closest,
    did_you_mean,
)
from rbstab.config.files.wrong_lines import wrong_line
from rbstab.files.regular_file import open_regular
from rbstab.files.shell_words import shell_word

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
"""What to do if there is no file with such a name, nor with a similar one."""

MAX_DEPTH = 16
"""Largest depth of nested mappings and lists."""

TOO_DEEP = "is nested too deeply", f"at most {MAX_DEPTH} levels"
"""The problem of a text with more levels, and what is expected."""

LIBRARY_TOO_DEEP = "maximum nesting depth"
"""What libyaml says of 1,000 levels. It reads so many brackets before it reports the first one."""

MAX_KEYS = 1000
"""Largest number of keys of a mapping. No config or plan has so many; unknown keys cost time."""

MAX_CONTAINERS = 10_000
"""Largest number of mappings and lists in a document."""

_INTEGER = re.compile(r"[-+]?[0-9]{1,18}")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_WORDS = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL"), None),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
    **dict.fromkeys((".nan", ".NaN", ".NAN"), math.nan),
    **{f"{sign}{inf}": math.inf for sign in ("", "+") for inf in (".inf", ".Inf", ".INF")},
    **dict.fromkeys(("-.inf", "-.Inf", "-.INF"), -math.inf),
}

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


def read_source(path: FilePath) -> Source:
    """Read a YAML file.

    A file in UTF-16 has a byte order mark. The PowerShell of Windows writes
    `rbstab show --config > FILE` in this encoding.

    Raises:
        ConfigError: It is not a file, cannot be read, is larger than 1 MiB, or is not YAML.
    """
    name = str(path)
    try:
        with open_regular(path) as file:
            raw = file.read(MAX_FILE_SIZE + 1)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        hint = _other_files(path, error)
        found = f"cannot be read: {reason}"
        raise ConfigError.at(Location(name), found, f"expected a YAML file{hint}") from error
    if raw.startswith(HDF5):
        expected = "`rbstab show` prints a result, rbstab.open_result opens it"
        found = "is an HDF5 file, as results are"
        raise ConfigError.at(Location(name), found, f"expected a YAML file; {expected}")
    if len(raw) > MAX_FILE_SIZE:
        expected = "expected a config of a few kilobytes"
        raise ConfigError.at(Location(name), "is larger than 1 MiB", expected)
    encoding = "utf-16" if raw.startswith(UTF_16_MARKS) else "utf-8"
    try:
        text = raw.decode(encoding).removeprefix(BYTE_ORDER_MARK)
    except UnicodeDecodeError as error:
        before = raw[: error.start].decode(encoding).removeprefix(BYTE_ORDER_MARK)
        where = _location_after(before, name)
        found = "is not text in UTF-16, as it begins"
        if encoding != "utf-16":
            found = f"is not text: byte 0x{error.object[error.start]:02x}"
        raise ConfigError.at(where, found, "expected UTF-8") from error
    source = parse_source(text, name)
    source.folder = path.parent
    return source


def _other_files(path: FilePath, error: Exception) -> str:
    """Return a hint to a file with a similar name, to those in a folder, or where to begin."""
    is_folder = isinstance(error, IsADirectoryError)
    if not is_folder and not isinstance(error, FileNotFoundError):
        return ""
    try:
        folder = path if is_folder else path.parent
        files = {file.stem: file for file in sorted(folder.iterdir()) if file.suffix in YAML}
    except OSError:
        files = {}
    if is_folder:
        endings = sorted({file.suffix for file in files.values()})
        patterns = " ".join(f"{shell_word(path)}/*{ending}" for ending in endings)
        return f"; name those in it: {patterns}" if patterns else ""
    near = closest(path.stem, files)
    return f"; {BEGIN}" if near is None else f"; {did_you_mean([str(files[near])])}"


def parse_source(text: str, name: str, column_offset: int = 0) -> Source:
    """Read YAML text.

    Args:
        text: The text.
        name: The source name in locations.
        column_offset: Added to the columns of locations in the first line.

    Raises:
        ConfigError: The text is not YAML, or not in the subset.
    """
    forbidden = Reader.NON_PRINTABLE.search(text)
    if forbidden is not None:
        # Checked here because libyaml gives the position of such a character in bytes.
        where = _location_after(text[: forbidden.start()], name, column_offset)
        raise ConfigError.at(where, "has a character that YAML forbids", "expected text")
    reader = _Reader(name, column_offset)
    try:
        reader.read(yaml.parse(text, Loader=_Loader))
    except _UnreadableError:
        pass
    except yaml.MarkedYAMLError as error:
        where = reader.location(error.problem_mark or error.context_mark)
        problem, expected = error.problem or "is not YAML", "YAML"
        # As libyaml counts lines: the other line ends of Unicode are none of YAML's here.
        lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")[: where.line]
        if LIBRARY_TOO_DEEP in problem:
            problem, expected = TOO_DEEP
        elif wrong := wrong_line(lines):
            line, column, problem, expected = wrong
            where = reader.place(line, column)
        reader.report(where, problem, expected, last=True)
    else:
        return reader.source
    raise ConfigError(reader.source.problems)


class _UnreadableError(Exception):
    """The rest of the document cannot be read; the problem is already reported."""


class _Reader:
    """A reader that builds plain data from YAML events, one value in another."""

    def __init__(self, name: str, column_offset: int) -> None:
        self.name = name
        self.column_offset = column_offset
        self.source = Source(None, {(): self.place(1, 1)})
        self.events: Iterator[Any] = iter(())
        self.containers = 0

    def place(self, line: int, column: int) -> Location:
        """Return a location; lines and columns count from 1."""
        return Location(self.name, line, column + (self.column_offset if line == 1 else 0))

    def location(self, mark: Any) -> Location:
        """Return the location of a mark of the library."""
        return Location(self.name) if mark is None else self.place(mark.line + 1, mark.column + 1)

    def report(
        self, where: Location, problem: str, expected: str, path: Path = (), *, last: bool = False
    ) -> None:
        """Note a problem, and stop if there are very many."""
        found = ConfigProblem(where, key_of(path), problem, f"expected {expected}")
        self.source.problems.append(found)
        if len(self.source.problems) >= MAX_PROBLEMS and not last:
            raise _UnreadableError

    def stop(self, where: Location, problem: str, expected: str, path: Path = ()) -> None:
        """Note a problem after which nothing can be read."""
        self.report(where, problem, expected, path)
        raise _UnreadableError

    def read(self, events: Iterator[Any]) -> None:
        """Read the only document of a stream."""
        self.events = events
        starts = (event for event in events if isinstance(event, yaml.DocumentStartEvent))
        for number, event in enumerate(starts):
            if number > 0:
                self.stop(
                    self.location(event.start_mark), "starts a second document", "one document"
                )
            self.source.data = self.value(next(events), ())

    def value(self, event: Any, path: Path) -> Any:
        """Return the value that begins with an event."""
        where = self.source.values[path] = self.location(event.start_mark)
        if self.is_alias(event, where, path):
            return None
        # Scalars first: a plan may have a list of some 100,000 numbers.
        if isinstance(event, yaml.ScalarEvent):
            return _plain_scalar(event.value) if event.implicit[0] else event.value
        if len(path) >= MAX_DEPTH:
            self.stop(where, *TOO_DEEP)
        self.containers += 1
        if self.containers > MAX_CONTAINERS:
            found = f"is mapping or list number {self.containers}"
            self.stop(where, found, f"at most {MAX_CONTAINERS}", path)
        return (
            self.entries(path) if isinstance(event, yaml.SequenceStartEvent) else self.items(path)
        )

    def is_alias(self, event: Any, where: Location, path: Path) -> bool:
        """Report an alias, a tag or an anchor; return whether it is an alias."""
        if isinstance(event, yaml.AliasEvent):
            self.report(where, f"is the alias *{event.anchor}", "values written out", path)
            return True
        if event.tag is not None and event.tag != "!":
            self.report(where, f"has the tag {event.tag}", "no tags", path)
        if event.anchor is not None:
            self.report(where, f"has the anchor &{event.anchor}", "no anchors", path)
        return False

    def entries(self, path: Path) -> list[Any]:
        """Return the list whose first event was read."""
        found: list[Any] = []
        while not isinstance(event := next(self.events), yaml.SequenceEndEvent):
            place = (*path, len(found))
            found.append(self.value(event, place))
            is_plain = isinstance(event, yaml.ScalarEvent) and event.implicit[0]
            # An entry that goes on in the next line has another indentation than was meant.
            if is_plain and event.end_mark.line > event.start_mark.line:
                where = self.source.values[place]
                self.report(
                    where._replace(line=where.line + 1, column=1),
                    "goes on with the entry of the line above",
                    f"an entry that begins in column {max(1, where.column - 2)}",
                    place,
                )
        return found

    def items(self, path: Path) -> dict[str, Any]:
        """Return the mapping whose first event was read."""
        found: dict[str, Any] = {}
        while not isinstance(key := next(self.events), yaml.MappingEndEvent):
            where = self.location(key.start_mark)
            if self.is_alias(key, where, path):
                raise _UnreadableError
            if not isinstance(key, yaml.ScalarEvent):
                self.stop(where, "has a mapping or a list as a key", "text as a key", path)
            inner = (*path, key.value)
            first = self.source.keys.setdefault(inner, where)
            if key.value in found:
                again = f"is given twice, first in line {first.line}"
                self.report(where, again, "each key once", inner)
                self.leave_out(inner)
                continue
            if len(found) >= MAX_KEYS:
                of_mapping = self.source.values[path]
                self.stop(of_mapping, f"has more than {MAX_KEYS} keys", f"at most {MAX_KEYS}", path)
            found[key.value] = self.value(next(self.events), inner)
        return found

    def leave_out(self, path: Path) -> None:
        """Read the value of a key that is given twice, and keep neither it nor its locations."""
        kept = self.source.values, self.source.keys
        self.source.values, self.source.keys = {}, {}
        self.value(next(self.events), path)
        self.source.values, self.source.keys = kept


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


def _location_after(before: str, name: str, column_offset: int = 0) -> Location:
    """Return the location after some text."""
    line = before.count("\n") + 1
    column = len(before) - before.rfind("\n")
    return Location(name, line, column + (column_offset if line == 1 else 0))
