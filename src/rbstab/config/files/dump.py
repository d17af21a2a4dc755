"""Writing plain data as YAML with the same meaning in YAML 1.1 and YAML 1.2."""

import re
from typing import Any

import yaml

_NEEDS_NO_QUOTES = re.compile(r"[A-Za-z][A-Za-z0-9_ ,()-]*[A-Za-z0-9_)]|[A-Z]")
_OTHER_LINE_ENDS = re.compile("[\r\x85\u2028\u2029]")
_AMBIGUOUS = re.compile(r"(null|true|false|yes|no|on|off|y|n)", re.IGNORECASE)


class _Dumper(yaml.SafeDumper):
    """A dumper that quotes every text which YAML 1.1 or 1.2 may read as another type."""


def _represent_text(dumper: _Dumper, text: str) -> yaml.ScalarNode:
    plain = _NEEDS_NO_QUOTES.fullmatch(text) and not _AMBIGUOUS.fullmatch(text)
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style=None if plain else '"')


class _Lines(str):
    """A text that is written as a block of lines."""

    __slots__ = ()


def _represent_lines(dumper: _Dumper, text: _Lines) -> yaml.ScalarNode:
    # YAML takes some rare characters as the end of a line. PyYAML itself quotes a text that would
    # not be the same in a block for another reason.
    style = '"' if _OTHER_LINE_ENDS.search(text) else "|"
    return dumper.represent_scalar("tag:yaml.org,2002:str", str(text), style=style)


def _represent_mapping(dumper: _Dumper, data: dict[str, Any]) -> yaml.MappingNode:
    if data.get("kind") == "python" and isinstance(data.get("source"), str):
        data = {**data, "source": _Lines(data["source"])}
    return dumper.represent_dict(data)


_Dumper.add_representer(str, _represent_text)
_Dumper.add_representer(_Lines, _represent_lines)
_Dumper.add_representer(dict, _represent_mapping)


def as_yaml(data: dict[str, Any]) -> str:
    """Return plain data as YAML, with the order of its keys, and lists of numbers on one line."""
    text: str = yaml.dump(
        data, Dumper=_Dumper, sort_keys=False, allow_unicode=True, default_flow_style=None, width=96
    )
    return text
