"""Reading YAML as plain data, with the location of every key and value.

Only a subset of YAML is read: one document of mappings, lists and plain scalars. Scalars follow the
core schema of YAML 1.2, where `1e-9` is a number and `no` is text, unlike in YAML 1.1. Aliases,
anchors, tags and duplicate keys are errors.
"""

import codecs
import re
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
from rbstab.files.regular_file import open_regular
from rbstab.files.shell_words import shell_word
from rbstab.files.yaml_lines import wrong_line

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

MAX_DEPTH = 16
"""Largest depth of nested mappings and lists."""

TOO_DEEP = "is nested too deeply", f"at most {MAX_DEPTH} levels"
"""The problem of a text with more levels, and what is expected."""

LIBRARY_TOO_DEEP = "maximum nesting depth"
"""What libyaml says of 1,000 levels. It reads so many brackets before it reports the first one."""

INDENTING_TAB = "begins with a tab", "spaces: YAML is not indented with tabs"
"""The problem of a line that cannot be read and begins with a tab, and what is expected."""

MAX_KEYS = 1000
"""Largest number of keys of a mapping. No config or plan has so many; unknown keys cost time."""

MAX_CONTAINERS = 10_000
"""Largest number of mappings and lists in a document."""

_INTEGER = re.compile(r"[-+]?[0-9]{1,18}")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_INFINITY = re.compile(r"[-+]?\.(inf|Inf|INF)")
_NAN = re.compile(r"\.(nan|NaN|NAN)")
_KEYWORDS = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL"), None),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
}

_Loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


@dataclass
class Source:
    """The data of a document, with the location of each value and key.

    Attributes:
        data: The plain data.
        values: The locations of the values.
        keys: The locations of the keys.
        problems: The problems that do not stop the parser (aliases, tags, duplicate keys). They are
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

    def remove_locations(self, path: Path, value: Any) -> None:
        """Remove the locations of the value at a path, and of everything in it."""
        for table in (self.values, self.keys):
            table.pop(path, None)
        # Walks the value only: a search of all locations would be slow in a large document.
        if isinstance(value, dict | list):
            entries = value.items() if isinstance(value, dict) else enumerate(value)
            for part, entry in entries:
                self.remove_locations((*path, part), entry)


def read_source(path: FilePath) -> Source:
    """Read a YAML file.

    Raises:
        ConfigError: As `read_text`; or it is not YAML.
    """
    source = parse_source(read_text(path).removeprefix(BYTE_ORDER_MARK), str(path))
    source.folder = path.parent
    return source


def read_text(path: FilePath) -> str:
    """Return the text of a YAML file, with its byte order mark if it has one.

    A file in UTF-16 has such a mark. The PowerShell of Windows writes `rbstab show --config > FILE`
    in this encoding.

    Raises:
        ConfigError: It is not a file, cannot be read, is larger than 1 MiB, or is not text.
    """
    name = str(path)
    try:
        with open_regular(path) as file:
            raw = file.read(MAX_FILE_SIZE + 1)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        hint = _near_name(path) if isinstance(error, FileNotFoundError) else ""
        hint = _files_in(path) if isinstance(error, IsADirectoryError) else hint
        raise _config_error(
            Location(name), f"cannot be read: {reason}", f"a YAML file{hint}"
        ) from error
    if len(raw) > MAX_FILE_SIZE and not raw.startswith(HDF5):
        raise _config_error(Location(name), "is larger than 1 MiB", "a config of a few kilobytes")
    if raw.startswith(HDF5):
        expected = "a YAML file; `rbstab show` prints a result, rbstab.open_result opens it"
        raise _config_error(Location(name), "is an HDF5 file, as results are", expected)
    if raw.startswith(UTF_16_MARKS):
        return BYTE_ORDER_MARK + _decoded_utf_16(raw, name)
    try:
        return raw.decode()
    except UnicodeDecodeError as error:
        before = raw[: error.start].decode().removeprefix(BYTE_ORDER_MARK)
        raise _config_error(
            _location_after(before, name), f"is not text: byte 0x{raw[error.start]:02x}", "UTF-8"
        ) from error


def _decoded_utf_16(raw: bytes, name: str) -> str:
    """Return the text of a file in UTF-16, without its byte order mark."""
    try:
        return raw.decode("utf-16")
    except UnicodeDecodeError as error:
        before = raw[: error.start].decode("utf-16")
        where = _location_after(before, name)
        raise _config_error(where, "is not text in UTF-16, as it begins", "UTF-8") from error


BEGIN = "`rbstab init` writes a first one, `rbstab examples` lists others"
"""What to do if there is no file with such a name, nor with a similar one."""


def _near_name(path: FilePath) -> str:
    """Return a hint for a file that does not exist: one with a similar name, or where to begin."""
    try:
        names = {file.stem: file for file in sorted(path.parent.iterdir()) if file.suffix in YAML}
    except OSError:
        names = {}
    near = closest(path.stem, names)
    if near is None:
        return f"; {BEGIN}"
    return f"; {did_you_mean([str(names[near])])}"


def _files_in(folder: FilePath) -> str:
    """Return a hint for a folder in place of a file: a pattern for the YAML files in it."""
    try:
        endings = {file.suffix for file in folder.iterdir() if file.suffix in YAML}
    except OSError:
        endings = set()
    named = [f"{shell_word(folder)}/*{ending}" for ending in YAML if ending in endings]
    return f"; name those in it: {' '.join(named)}" if named else ""


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
        raise _config_error(where, "has a character that YAML forbids", "text")
    parser = _Parser(name, column_offset)
    try:
        for event in yaml.parse(text, Loader=_Loader):
            parser.handle(event)
    except _UnreadableError:
        pass
    except yaml.MarkedYAMLError as error:
        where = parser.location(error.problem_mark or error.context_mark)
        problem, expected = error.problem or "is not YAML", "YAML"
        if LIBRARY_TOO_DEEP in problem:
            problem, expected = TOO_DEEP
        elif _has_indenting_tab(text, where):
            problem, expected = INDENTING_TAB
        elif wrong := wrong_line(_with_unix_lines(text), where.line):
            offset = column_offset if wrong.line == 1 else 0
            where = Location(name, wrong.line, wrong.column + offset)
            problem, expected = wrong.problem, wrong.expected
        parser.problems.append(_problem(where, problem, expected))
    else:
        return parser.source
    raise ConfigError(parser.problems)


def _has_indenting_tab(text: str, where: Location) -> bool:
    """Return whether the line of a location begins with white space that has a tab."""
    lines = _with_unix_lines(text).split("\n")
    line = lines[where.line - 1] if 0 < where.line <= len(lines) else ""
    return "\t" in line[: len(line) - len(line.lstrip(" \t"))]


def _with_unix_lines(text: str) -> str:
    # As libyaml counts: the other line ends of Unicode are none of YAML's here.
    return text.replace("\r\n", "\n").replace("\r", "\n")


class _UnreadableError(Exception):
    """The rest of the document cannot be read; the problem is already reported."""


@dataclass
class _OpenContainer:
    """A mapping or list that is being read, and the key whose value comes next."""

    container: dict[str, Any] | list[Any]
    path: Path
    key: str | None = None


class _Parser:
    """A parser that builds plain data from YAML events, without recursion."""

    def __init__(self, name: str, column_offset: int) -> None:
        self.name = name
        self.column_offset = column_offset
        self.source = Source(None, {(): Location(name, 1, 1 + column_offset)})
        self.problems = self.source.problems
        self.stack: list[_OpenContainer] = []
        self.documents = 0
        self.containers = 0

    def location(self, mark: Any) -> Location:
        if mark is None:
            return Location(self.name)
        offset = self.column_offset if mark.line == 0 else 0
        return Location(self.name, mark.line + 1, mark.column + 1 + offset)

    def report(self, where: Location, problem: str, expected: str, path: Path = ()) -> None:
        self.problems.append(_problem(where, problem, expected, path))
        if len(self.problems) >= MAX_PROBLEMS:
            raise _UnreadableError

    def handle(self, event: yaml.Event) -> None:
        where = self.location(event.start_mark)
        # Scalars first: a plan may have a list of some 100,000 numbers.
        if isinstance(event, yaml.ScalarEvent):
            self._check_node(event, where)
            self._add_scalar(event, where)
        elif isinstance(event, yaml.DocumentStartEvent):
            self.documents += 1
            if self.documents > 1:
                self.report(where, "starts a second document", "one document")
                raise _UnreadableError
        elif isinstance(event, yaml.AliasEvent):
            self.report(where, f"is the alias *{event.anchor}", "values written out", self._path())
            self._add_value(None, where)
        elif isinstance(event, yaml.CollectionStartEvent):
            self._check_node(event, where)
            self._open_container({} if isinstance(event, yaml.MappingStartEvent) else [], where)
        elif isinstance(event, yaml.CollectionEndEvent):
            self.stack.pop()

    def _path(self) -> Path:
        if not self.stack:
            return ()
        top = self.stack[-1]
        last = len(top.container) if isinstance(top.container, list) else top.key
        return top.path if last is None else (*top.path, last)

    def _check_node(self, event: Any, where: Location) -> None:
        if event.tag is not None and event.tag != "!":
            self.report(where, f"has the tag {event.tag}", "no tags", self._path())
        if event.anchor is not None:
            self.report(where, f"has the anchor &{event.anchor}", "no anchors", self._path())

    def _add_scalar(self, event: yaml.ScalarEvent, where: Location) -> None:
        plain = event.implicit[0]
        top = self.stack[-1] if self.stack else None
        if top is not None and isinstance(top.container, dict) and top.key is None:
            self._add_key(event.value, where)
        else:
            if plain and top is not None and isinstance(top.container, list):
                self._check_lines(event, where)
            self._add_value(_plain_scalar(event.value) if plain else event.value, where)

    def _check_lines(self, event: Any, where: Location) -> None:
        """Refuse an entry of a list that goes on in the next line: that has another indentation."""
        if event.end_mark.line > event.start_mark.line:
            below = where._replace(line=where.line + 1, column=1)
            expected = f"an entry that begins in column {max(1, where.column - 2)}"
            found = "goes on with the entry of the line above"
            self.report(below, found, expected, self._path())

    def _add_key(self, key: str, where: Location) -> None:
        top = self.stack[-1]
        path = (*top.path, key)
        assert isinstance(top.container, dict)
        if key in top.container:
            first = self.source.keys[path]
            self.report(where, f"is given twice, first in line {first.line}", "each key once", path)
            self.source.remove_locations(path, top.container[key])
            where = first  # a third key is also reported as a duplicate of the first
        elif len(top.container) >= MAX_KEYS:
            of_container = self.source.values[top.path]
            expected = f"at most {MAX_KEYS}"
            self.report(of_container, f"has more than {MAX_KEYS} keys", expected, top.path)
            raise _UnreadableError
        self.source.keys.setdefault(path, where)
        top.key = key

    def _open_container(self, container: dict[str, Any] | list[Any], where: Location) -> None:
        if len(self.stack) >= MAX_DEPTH:
            self.report(where, *TOO_DEEP)
            raise _UnreadableError
        self.containers += 1
        if self.containers > MAX_CONTAINERS:
            found = f"is mapping or list number {self.containers}"
            self.report(where, found, f"at most {MAX_CONTAINERS}", self._path())
            raise _UnreadableError
        top = self.stack[-1] if self.stack else None
        if top is not None and isinstance(top.container, dict) and top.key is None:
            self.report(where, "has a mapping or a list as a key", "text as a key", top.path)
            raise _UnreadableError
        path = self._path()
        self._add_value(container, where)
        self.stack.append(_OpenContainer(container, path))

    def _add_value(self, value: Any, where: Location) -> None:
        path = self._path()
        self.source.values[path] = where
        if not self.stack:
            self.source.data = value
            return
        top = self.stack[-1]
        if isinstance(top.container, list):
            top.container.append(value)
        elif top.key is None:
            raise _UnreadableError  # an alias as a key, already reported
        else:
            top.container[top.key] = value
            top.key = None


def key_of(path: Path) -> str:
    """Return the text of a path in messages and on the command line: `controller.K_t[0]`."""
    text = ""
    for part in path:
        word = part if part != "" else "''"
        text += f"[{part}]" if isinstance(part, int) else f".{word}" if text else f"{word}"
    return text


def _plain_scalar(text: str) -> Any:
    if text in _KEYWORDS:
        return _KEYWORDS[text]
    if _INTEGER.fullmatch(text):
        return int(text)
    if _FLOAT.fullmatch(text):
        return float(text)
    if _INFINITY.fullmatch(text) or _NAN.fullmatch(text):
        return float(text.replace(".", ""))
    return text


def _location_after(before: str, name: str, column_offset: int = 0) -> Location:
    """Return the location after some text."""
    line = before.count("\n") + 1
    column = len(before) - before.rfind("\n")
    return Location(name, line, column + (column_offset if line == 1 else 0))


def _problem(where: Location, problem: str, expected: str, path: Path = ()) -> ConfigProblem:
    return ConfigProblem(where, key_of(path), problem, f"expected {expected}")


def _config_error(where: Location, problem: str, expected: str) -> ConfigError:
    return ConfigError([_problem(where, problem, expected)])
