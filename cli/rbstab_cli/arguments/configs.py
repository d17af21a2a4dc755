"""Loading the configs of a command line, and saying all that is wrong with them."""

from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

import click

from rbstab_cli import exit_codes

if TYPE_CHECKING:
    from rbstab.config.errors import ConfigError
    from rbstab.config.schema import Config


def load_all(paths: Iterable[Path], changes: Iterable[str]) -> dict[Path, "Config"]:
    """The configs by their paths.

    Prints every error of every config and ends the command with exit code 2 if there is one; prints
    warnings, each once for all the configs that it is about.
    """
    from rbstab.config.errors import ConfigError
    from rbstab.config.load import load_config

    configs: dict[Path, Config] = {}
    # One list for all files: an error of the command line is said once, not once for each file.
    problems: dict[str, None] = {}
    for path in paths:
        try:
            configs[path] = load_config(path, changes)
        except ConfigError as error:
            problems.update(dict.fromkeys(_said(path, error)))
    end_with(problems)
    say_warnings({str(path): config for path, config in configs.items()})
    return configs


def end_with(problems: Iterable[str]) -> None:
    """Prints problems and ends the command with exit code 2, if there are any."""
    said = list(problems)
    for problem in said:
        click.echo(problem, err=True)
    if said:
        raise click.exceptions.Exit(exit_codes.USAGE)


def say_warnings(configs: dict[str, "Config"]) -> None:
    """Prints what is odd about configs, by what they are called; each warning once for all."""
    from rbstab.config.build import config_warnings

    warnings: dict[str, list[str]] = {}
    for label, config in configs.items():
        for warning in config_warnings(config):
            warnings.setdefault(warning, []).append(label)
    for warning, where in warnings.items():
        more = f" and {len(where) - 1} more" if len(where) > 1 else ""
        click.echo(f"warning: {where[0]}{more}: {warning}", err=True)


def _said(path: Path, error: "ConfigError") -> list[str]:
    """What is wrong with a config, in lines; one line where it is a plan."""
    from rbstab.config.errors import ConfigError, Location, Problem
    from rbstab.sweep.plan.load import is_plan

    with suppress(ConfigError):
        if is_plan(path):
            expected = "expected a config; `rbstab run PLAN --member N` runs one of its members"
            return [str(Problem(Location(str(path)), "", "is the plan of a sweep", expected))]
    return [str(problem) for problem in error.problems]


CHANGES = click.option(
    "--set",
    "changes",
    multiple=True,
    metavar="KEY=VALUE",
    help="Replace a value of every config: body.mass=50, controller.K_t[0]=5000. Repeatable.",
)
"""The option --set, the same for every command that reads configs."""
