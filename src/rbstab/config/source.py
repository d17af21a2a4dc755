"""YAML text to plain data, with the place of every key and value.

Only what a config needs is read: one document of mappings, lists and plain scalars, the latter by
the core schema of YAML 1.2 (so `1e-9` is a number and `no` is text, unlike in YAML 1.1). Aliases,
tags and duplicate keys are errors.
"""

import codecs
import re
from dataclasses import dataclass, field
from pathlib import Path as FilePath
from typing import Any

import yaml
from yaml.reader import Reader

from rbstab.config.errors import MAX_PROBLEMS, ConfigError, Location, Problem

Path = tuple[str | int, ...]
"""Keys and list indices from the root of the document to a value."""

MAX_FILE_SIZE = 1 << 20
"""Bytes."""

MAX_DEPTH = 16
"""Mappings and lists inside each other."""

_INTEGER = re.compile(r"[-+]?[0-9]{1,18}")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_INFINITY = re.compile(r"[-+]?\.(inf|Inf|INF)")
_NAN = re.compile(r"\.(nan|NaN|NAN)")
_WORDS = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL"), None),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
}

_Loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


@dataclass
class Source:
    """The data of a document, and where each value and each key of it stands.

    `problems` are those that leave the rest of the document readable (aliases, tags, duplicate
    keys): they are reported together with what is wrong in the data itself.
    """

    data: Any
    values: dict[Path, Location] = field(default_factory=dict)
    keys: dict[Path, Location] = field(default_factory=dict)
    problems: list[Problem] = field(default_factory=list)

    def location(self, path: Path, *, of_key: bool = False) -> Location:
        """The place of a value (or of its key); of its nearest parent where it is absent."""
        table = self.keys if of_key else self.values
        while path and path not in table:
            table, path = self.values, path[:-1]
        return table[path]

    def forget(self, path: Path) -> None:
        """Drops the places of a value and of all that is in it."""
        for table in (self.values, self.keys):
            for old in [p for p in table if p[: len(path)] == path]:
                del table[old]


def read_source(path: FilePath) -> Source:
    """Reads a YAML file.

    Raises:
        ConfigError: The file cannot be read, is larger than 1 MiB, is not UTF-8, or is not YAML.
    """
    name = str(path)
    try:
        with path.open("rb") as file:
            raw = file.read(MAX_FILE_SIZE + 1)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise _single(Location(name), f"cannot be read: {reason}", "a YAML file") from error
    if len(raw) > MAX_FILE_SIZE:
        raise _single(Location(name), "is larger than 1 MiB", "a config of a few kilobytes")
    raw = raw.removeprefix(codecs.BOM_UTF8)
    try:
        text = raw.decode()
    except UnicodeDecodeError as error:
        where = _place_in(raw[: error.start].decode(), name)
        raise _single(where, f"is not text: byte 0x{raw[error.start]:02x}", "UTF-8") from error
    return parse_source(text, name)


def parse_source(text: str, name: str, column_offset: int = 0) -> Source:
    """Reads YAML text; `name` stands for it in locations, shifted by `column_offset` columns.

    Raises:
        ConfigError: As `read_source`.
    """
    forbidden = Reader.NON_PRINTABLE.search(text)
    if forbidden is not None:
        # Looked for here, because libyaml tells its place in bytes.
        where = _place_in(text[: forbidden.start()], name, column_offset)
        raise _single(where, "has a character that YAML forbids", "text")
    parser = _Parser(name, column_offset)
    try:
        for event in yaml.parse(text, Loader=_Loader):
            parser.take(event)
    except _UnreadableError:
        pass
    except yaml.MarkedYAMLError as error:
        where = parser.place(error.problem_mark or error.context_mark)
        parser.problems.append(_problem(where, error.problem or "is not YAML", "YAML"))
    else:
        return parser.source
    raise ConfigError(parser.problems)


class _UnreadableError(Exception):
    """Reading on makes no sense; the reason is noted."""


@dataclass
class _Open:
    """A mapping or list that is being read; `key` waits for its value."""

    container: dict[str, Any] | list[Any]
    path: Path
    key: str | None = None


class _Parser:
    """Builds data from YAML events, one after the other, without recursion."""

    def __init__(self, name: str, column_offset: int) -> None:
        self.name = name
        self.column_offset = column_offset
        self.source = Source(None, {(): Location(name, 1, 1 + column_offset)})
        self.problems = self.source.problems
        self.open: list[_Open] = []
        self.documents = 0

    def place(self, mark: Any) -> Location:
        if mark is None:
            return Location(self.name)
        offset = self.column_offset if mark.line == 0 else 0
        return Location(self.name, mark.line + 1, mark.column + 1 + offset)

    def note(self, where: Location, problem: str, expected: str, path: Path = ()) -> None:
        self.problems.append(_problem(where, problem, expected, path))
        if len(self.problems) >= MAX_PROBLEMS:
            raise _UnreadableError

    def take(self, event: yaml.Event) -> None:
        where = self.place(event.start_mark)
        if isinstance(event, yaml.DocumentStartEvent):
            self.documents += 1
            if self.documents > 1:
                self.note(where, "starts a second document", "one document")
                raise _UnreadableError
        elif isinstance(event, yaml.AliasEvent):
            self.note(where, f"is the alias *{event.anchor}", "values written out", self._path())
            self._value(None, where)
        elif isinstance(event, yaml.ScalarEvent):
            self._check_node(event, where)
            self._scalar(event, where)
        elif isinstance(event, yaml.CollectionStartEvent):
            self._check_node(event, where)
            self._start({} if isinstance(event, yaml.MappingStartEvent) else [], where)
        elif isinstance(event, yaml.CollectionEndEvent):
            self.open.pop()

    def _path(self) -> Path:
        if not self.open:
            return ()
        top = self.open[-1]
        last = len(top.container) if isinstance(top.container, list) else top.key
        return top.path if last is None else (*top.path, last)

    def _check_node(self, event: Any, where: Location) -> None:
        if event.tag is not None and event.tag != "!":
            self.note(where, f"has the tag {event.tag}", "no tags", self._path())
        if event.anchor is not None:
            self.note(where, f"has the anchor &{event.anchor}", "no anchors", self._path())

    def _scalar(self, event: yaml.ScalarEvent, where: Location) -> None:
        plain = event.implicit[0]
        top = self.open[-1] if self.open else None
        if top is not None and isinstance(top.container, dict) and top.key is None:
            self._key(event.value, where)
        else:
            self._value(_plain_scalar(event.value) if plain else event.value, where)

    def _key(self, key: str, where: Location) -> None:
        top = self.open[-1]
        path = (*top.path, key)
        if key in top.container:
            first = self.source.keys[path]
            self.note(where, f"stands twice, first in line {first.line}", "each key once", path)
            self.source.forget(path)
            where = first  # a third one is told of the first as well
        self.source.keys.setdefault(path, where)
        top.key = key

    def _start(self, container: dict[str, Any] | list[Any], where: Location) -> None:
        if len(self.open) >= MAX_DEPTH:
            self.note(where, "is nested too deeply", f"at most {MAX_DEPTH} levels")
            raise _UnreadableError
        top = self.open[-1] if self.open else None
        if top is not None and isinstance(top.container, dict) and top.key is None:
            self.note(where, "has a mapping or a list as a key", "text as a key", top.path)
            raise _UnreadableError
        path = self._path()
        self._value(container, where)
        self.open.append(_Open(container, path))

    def _value(self, value: Any, where: Location) -> None:
        path = self._path()
        self.source.values[path] = where
        if not self.open:
            self.source.data = value
            return
        top = self.open[-1]
        if isinstance(top.container, list):
            top.container.append(value)
        elif top.key is None:
            raise _UnreadableError  # an alias as a key, which is noted already
        else:
            top.container[top.key] = value
            top.key = None


def key_of(path: Path) -> str:
    """A path as it is written in messages and on the command line: `controller.K_t[0]`."""
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
    if _FLOAT.fullmatch(text):
        return float(text)
    if _INFINITY.fullmatch(text) or _NAN.fullmatch(text):
        return float(text.replace(".", ""))
    return text


def _place_in(before: str, name: str, column_offset: int = 0) -> Location:
    """The place behind some text."""
    line = before.count("\n") + 1
    column = len(before) - before.rfind("\n")
    return Location(name, line, column + (column_offset if line == 1 else 0))


def _problem(where: Location, problem: str, expected: str, path: Path = ()) -> Problem:
    return Problem(where, key_of(path), problem, f"expected {expected}")


def _single(where: Location, problem: str, expected: str) -> ConfigError:
    return ConfigError([_problem(where, problem, expected)])
