"""The config of a run as it stands in its result."""

from typing import Any

from rbstab.config.errors import ConfigError
from rbstab.config.load import validated
from rbstab.config.schema import Config
from rbstab.config.source import Source, parse_source
from rbstab.store.result import Result


def stored_config(result: Result) -> Config | None:
    """The config of a result; None where this version of the program cannot read it."""
    source = _source(result)
    if source is None:
        return None
    try:
        return validated(source)
    except ConfigError:
        return None


def stored_data(result: Result) -> dict[str, Any]:
    """The config of a result as plain data, whatever it says; empty where it is no YAML."""
    source = _source(result)
    return {} if source is None else source.data


def _source(result: Result) -> Source | None:
    try:
        source = parse_source(result.config, "config")
    except ConfigError:
        return None
    return source if isinstance(source.data, dict) else None
