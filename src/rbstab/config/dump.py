"""Plain data to YAML that every reader understands alike."""

import re
from typing import Any

import yaml

_PLAIN = re.compile(r"[A-Za-z][A-Za-z0-9_ ,()-]*[A-Za-z0-9_)]|[A-Z]")
_AMBIGUOUS = re.compile(r"(null|true|false|yes|no|on|off|y|n)", re.IGNORECASE)


class _Dumper(yaml.SafeDumper):
    """Quotes every text that YAML 1.1 or 1.2 might take for something else."""


def _text(dumper: _Dumper, text: str) -> yaml.ScalarNode:
    plain = _PLAIN.fullmatch(text) and not _AMBIGUOUS.fullmatch(text)
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style=None if plain else '"')


_Dumper.add_representer(str, _text)


def as_yaml(data: dict[str, Any]) -> str:
    """The YAML of plain data, keys in their order, lists of numbers in one line."""
    text: str = yaml.dump(
        data, Dumper=_Dumper, sort_keys=False, allow_unicode=True, default_flow_style=None, width=96
    )
    return text
