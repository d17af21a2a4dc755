"""Warnings of results, printed on stderr after the answers."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from rbstab.config.schema import Config
    from rbstab.store.result import Result


def own_warnings(result: "Result", config: "Config") -> list[str]:
    """Return the warnings of a result, without those about its config.

    A command that reads a config prints the warnings about it at once.
    """
    from rbstab.config.warnings import config_warnings

    of_config = config_warnings(config)
    stored = str(result.attributes.get("warnings", "")).splitlines()
    return [warning for warning in stored if warning not in of_config]


def print_result_warnings(path: Path, warnings: Sequence[str]) -> None:
    """Print the warnings of the result in a file."""
    for warning in warnings:
        click.echo(f"warning: {path}: {warning}", err=True)
