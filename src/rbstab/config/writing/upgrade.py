"""Rewriting the text of a config of schema version 1 as version 2; all else in it stays."""

import re
from pathlib import Path

from rbstab.config.errors import ConfigError, ConfigProblem, Location
from rbstab.config.load import resolved, source_of, validated
from rbstab.config.schema import Config
from rbstab.config.source import BYTE_ORDER_MARK, Source, parse_source, read_text
from rbstab.config.user_code.files import embed_files

KEY = "schema_version"

_INTEGER = re.compile(r"[-+]?[0-9]+")

# The characters at which the parser starts a new line; an editor does so at the first three only.
_LINE_START = re.compile("\r\n|[\n\r\x85\u2028\u2029]")
_LINE_BREAK = re.compile("\r\n|\n|\r")


def upgraded_text(path: Path) -> str | None:
    """Return the text of a config with schema version 2; None if it has that version already.

    Comments, order, spacing, quotes, line ends and a byte order mark stay. The new text is loaded:
    its config is the old one but for `schema_version`, and `elements`, which are empty.

    Args:
        path: The file of the config. It is not written.

    Raises:
        ConfigError: The config is wrong, or its text cannot be rewritten.
    """
    whole = read_text(path)
    text = whole.removeprefix(BYTE_ORDER_MARK)
    source = source_of(parse_source(text, str(path)))
    source.folder = path.parent
    embed_files(source)
    config = validated(source)
    if config.schema_version == 2:
        return None
    new = _rewritten(text, source)
    if not _is_upgraded(config, new):
        found = "cannot be changed without a change of anything else"
        expected = "expected schema_version: 1 in a line of its own"
        raise ConfigError([ConfigProblem(source.location((KEY,)), KEY, found, expected)])
    return whole[: len(whole) - len(text)] + new


def _rewritten(text: str, source: Source) -> str:
    """Return the text with another version, or with the version before its first key."""
    if (KEY,) in source.values:
        start = _offset(text, source.values[KEY,])
        found = _INTEGER.match(text, start)
        return text if found is None else f"{text[:start]}2{text[found.end() :]}"
    start = _offset(text, source.values[()])
    if text[start] == "{":
        return _with_flow_key(text, start, _offset(text, source.keys[next(iter(source.data)),]))
    indent = text[_line_start(text, start) : start]
    return f"{text[:start]}{KEY}: 2{_line_break(text, start)}{indent}{text[start:]}"


def _with_flow_key(text: str, brace: int, first: int) -> str:
    """Return the text with the version as the first key of a mapping in braces.

    Args:
        text: The text.
        brace: Where its opening brace is.
        first: Where its first key starts; the version is quoted and laid out like it.
    """
    quote = text[first] if text[first] in "\"'" else ""
    begin = _line_start(text, first)
    after = f"{_line_break(text, brace)}{text[begin:first]}" if begin > brace else " "
    return f"{text[:first]}{quote}{KEY}{quote}: 2,{after}{text[first:]}"


def _is_upgraded(old: Config, text: str) -> bool:
    """Whether a text is the config `old` with schema version 2, and no elements."""
    try:
        new = validated(source_of(parse_source(text, "")))
    except ConfigError:
        return False
    return resolved(new) == {**resolved(old), KEY: 2, "elements": {}}


def _offset(text: str, where: Location) -> int:
    """Return the index of the character at a line and a column, both from 1."""
    starts = [0, *(found.end() for found in _LINE_START.finditer(text))]
    return starts[where.line - 1] + where.column - 1


def _line_start(text: str, index: int) -> int:
    """Return the index at which the line of a character starts."""
    return max((found.end() for found in _LINE_START.finditer(text, 0, index)), default=0)


def _line_break(text: str, index: int) -> str:
    """Return the first line break after a character."""
    found = _LINE_BREAK.search(text, index)
    return "\n" if found is None else found[0]
