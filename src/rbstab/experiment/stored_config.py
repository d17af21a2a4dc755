"""The config of a run, read from its result."""

from typing import Any, NamedTuple

from rbstab.config.errors import ConfigError
from rbstab.config.load import validated
from rbstab.config.schema import Config
from rbstab.config.source import parse_source
from rbstab.store.result import Result


class StoredConfig(NamedTuple):
    """A config, and its text as plain data.

    config is None if this version of the program cannot read it. data is the parsed text, which may
    be invalid as a config; it is empty if the text is not a YAML mapping.
    """

    config: Config | None
    data: dict[str, Any]


def stored_config(result: Result) -> StoredConfig:
    """Return the config of a result."""
    try:
        source = parse_source(result.config, "config")
    except ConfigError:
        return StoredConfig(None, {})
    if not isinstance(source.data, dict):
        return StoredConfig(None, {})
    try:
        return StoredConfig(validated(source), source.data)
    except ConfigError:
        return StoredConfig(None, source.data)
