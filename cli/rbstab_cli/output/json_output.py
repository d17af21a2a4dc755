"""JSON on stdout."""

import json
import math
from typing import Any

import click


def print_json(data: Any) -> None:
    """Print data as JSON."""
    click.echo(as_json_text(data))


def as_json_text(data: Any) -> str:
    """Return data as JSON; NaN and infinite numbers, which JSON does not have, become null."""
    return json.dumps(_finite(data), indent=2, ensure_ascii=False, allow_nan=False)


def _finite(data: Any) -> Any:
    if isinstance(data, dict):
        return {key: _finite(value) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [_finite(value) for value in data]
    if isinstance(data, float) and not math.isfinite(data):
        return None
    return data
