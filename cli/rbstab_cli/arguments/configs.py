"""Load the configs on a command line, and print their errors and warnings."""

from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

import click

from rbstab_cli import exit_codes

if TYPE_CHECKING:
    from rbstab.config.errors import ConfigError
    from rbstab.config.schema import Config
    from rbstab.sweep.plan.plan import Plan

RESULT_SUFFIX = ".h5"


def load_all(
    paths: Iterable[Path],
    changes: Iterable[str],
    *,
    allow_python: bool | None = False,
    problems: Iterable[str] = (),
) -> dict[Path, "Config"]:
    """Load configs, and print their errors or warnings.

    If any config has an error, print all errors of all configs and end the command with exit code
    2. Otherwise print the warnings, each once for all configs.

    Args:
        paths: The files of the configs.
        changes: Texts `key=value` that replace single values.
        allow_python: Whether the files of users' elements may be run; None if the configs are only
            read.
        problems: Problems of other files, which are printed first.

    Returns:
        The configs by their paths.
    """
    from rbstab.config.errors import ConfigError
    from rbstab.config.load import config_to_read, load_config

    configs: dict[Path, Config] = {}
    # One list for all files prints an error of the command line once, not once for each file.
    found = dict.fromkeys(problems)
    for path in paths:
        try:
            configs[path] = (
                config_to_read(path, changes)
                if allow_python is None
                else load_config(path, changes, allow_python=allow_python)
            )
        except ConfigError as error:
            found.update(dict.fromkeys(problem_lines(path, error)))
    exit_on_problems(found)
    print_warnings({str(path): config for path, config in configs.items()})
    return configs


def exit_on_problems(problems: Iterable[str]) -> None:
    """Print problems, and end the command with exit code 2 if there are any."""
    lines = list(problems)
    for line in lines:
        click.echo(line, err=True)
    if lines:
        raise click.exceptions.Exit(exit_codes.USAGE)


def print_warnings(configs: dict[str, "Config"]) -> None:
    """Print the warnings about configs, each once for all configs.

    Args:
        configs: The configs by their names in messages.
    """
    from rbstab.config.warnings import config_warnings

    warnings: dict[str, list[str]] = {}
    for label, config in configs.items():
        for warning in config_warnings(config):
            warnings.setdefault(warning, []).append(label)
    for warning, labels in warnings.items():
        more = f" and {len(labels) - 1} more" if len(labels) > 1 else ""
        click.echo(f"warning: {labels[0]}{more}: {warning}", err=True)


def print_plan_warnings(path: Path, plan: "Plan") -> None:
    """Print the warnings about the bases of a plan, each once."""
    from rbstab.config.warnings import config_warnings

    warnings = [warning for base in plan.bases.values() for warning in config_warnings(base)]
    for warning in dict.fromkeys(warnings):
        click.echo(f"warning: {path}: {warning}", err=True)


def is_result_file(path: Path) -> bool:
    """Return whether a path is the file of a result; False if the disk reports an error.

    Then the problems of reading it say which.
    """
    from rbstab.files.existence import is_file

    with suppress(OSError):
        return path.suffix == RESULT_SUFFIX and is_file(path)
    return False


def result_problem(path: Path, wanted: str) -> str:
    """Return a line on the file of a result that was named in place of a config or a plan."""
    from rbstab.config.errors import ConfigProblem, Location
    from rbstab.files.shell_words import shell_word

    expected = f"expected {wanted}; look at it: rbstab show {shell_word(path)}"
    return str(ConfigProblem(Location(str(path)), "", "is the file of a result", expected))


def problem_lines(path: Path, error: "ConfigError") -> list[str]:
    """Return one line for each problem of a config; a single line if the file is a plan.

    Args:
        path: The file.
        error: The error with its problems.
    """
    from rbstab.config.errors import ConfigError, ConfigProblem, Location
    from rbstab.files.shell_words import shell_word
    from rbstab.sweep.plan.load import is_plan

    if is_result_file(path):
        return [result_problem(path, "a config")]
    with suppress(ConfigError):
        if is_plan(path):
            word = shell_word(path)
            run = f"run all its members: rbstab sweep {word}; one: rbstab run {word} --member N"
            expected = f"expected a config; {run}"
            return [str(ConfigProblem(Location(str(path)), "", "is the plan of a sweep", expected))]
    return [naming_example(path, str(problem)) for problem in error.problems]


def naming_example(path: Path, line: str) -> str:
    """Return a line about a missing file; if an example has its name, with how to copy that."""
    from rbstab.config.source import BEGIN

    if BEGIN not in line:
        return line
    from rbstab.packaged.examples import names

    found = [name for name in names() if name.rpartition("/")[2] == path.stem]
    return line.replace(BEGIN, f"`rbstab examples {found[0]}` copies it") if found else line
