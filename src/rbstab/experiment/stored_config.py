"""The config of a run as it stands in its result."""

from typing import Any, NamedTuple

from rbstab.config.errors import ConfigError
from rbstab.config.load import validated
from rbstab.config.schema import Config
from rbstab.config.source import parse_source
from rbstab.store.result import Result


class StoredConfig(NamedTuple):
    """A config, None where this version of the program cannot read it, and the same as plain data.

    The data are what the text says, whatever that is; none where it is no YAML.
    """

    config: Config | None
    data: dict[str, Any]


def stored_config(result: Result) -> StoredConfig:
    """The config of a result."""
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
