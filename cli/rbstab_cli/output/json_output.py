"""JSON on stdout."""

import json
import math
import sys
from typing import Any

import click

from rbstab_cli.streams import is_utf8


def print_json(data: Any) -> None:
    """Print data as JSON; only ASCII characters, with JSON's escapes, if stdout is not UTF-8."""
    click.echo(as_json_text(data, ensure_ascii=not is_utf8(sys.stdout)))


def as_json_text(data: Any, *, ensure_ascii: bool = False) -> str:
    """Return data as JSON; NaN and infinite numbers, which JSON does not have, become null."""
    return json.dumps(_finite(data), indent=2, ensure_ascii=ensure_ascii, allow_nan=False)


def _finite(data: Any) -> Any:
    if isinstance(data, dict):
        return {key: _finite(value) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [_finite(value) for value in data]
    if isinstance(data, float) and not math.isfinite(data):
        return None
    return data
