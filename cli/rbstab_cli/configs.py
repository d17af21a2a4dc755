"""Loading the configs of a command line, and saying all that is wrong with them."""

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import click

from rbstab_cli import exit_codes

if TYPE_CHECKING:
    from rbstab.config.schema import Config


def load_all(paths: Iterable[Path], changes: Iterable[str]) -> dict[Path, "Config"]:
    """The configs by their paths.

    Prints every error of every config and ends the command with exit code 2 if there is one; prints
    warnings, each once for all the configs that it is about.
    """
    from rbstab.config.build import warnings_of
    from rbstab.config.errors import ConfigError
    from rbstab.config.load import load_config

    configs: dict[Path, Config] = {}
    # One list for all files: an error of the command line is said once, not once for each file.
    problems: dict[str, None] = {}
    for path in paths:
        try:
            configs[path] = load_config(path, changes)
        except ConfigError as error:
            problems.update(dict.fromkeys(str(problem) for problem in error.problems))
    if problems:
        for problem in problems:
            click.echo(problem, err=True)
        raise click.exceptions.Exit(exit_codes.USAGE)
    warnings: dict[str, list[str]] = {}
    for path, config in configs.items():
        for warning in warnings_of(config):
            warnings.setdefault(warning, []).append(str(path))
    for warning, where in warnings.items():
        more = f" and {len(where) - 1} more" if len(where) > 1 else ""
        click.echo(f"warning: {where[0]}{more}: {warning}", err=True)
    return configs


CHANGES = click.option(
    "--set",
    "changes",
    multiple=True,
    metavar="KEY=VALUE",
    help="Replace a value of every config: body.mass=50, controller.K_t[0]=5000. Repeatable.",
)
"""The option --set, the same for every command that reads configs."""
