"""Configs and plans on the command line: loaded together, or refused with all their problems."""

from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import click

from rbstab.config.errors import ConfigError, ConfigProblem, Location
from rbstab.config.load import config_to_read, load_config
from rbstab.config.schema import Config
from rbstab.config.source import BEGIN
from rbstab.config.warnings import config_warnings
from rbstab.files.paths import is_file
from rbstab.files.text import shell_word
from rbstab_cli import exit_codes
from rbstab_cli.errors import Failed
from rbstab_cli.printing import say

if TYPE_CHECKING:
    from rbstab.sweep.plan.plan import Plan

T = TypeVar("T")

A_CONFIG, A_PLAN = "a config", "a plan with base and vary"

RESULT_SUFFIX = ".h5"


def loaded(paths: Iterable[Path], load: Callable[[Path], T], wanted: str = "") -> dict[Path, T]:
    """Load files; if any has an error, end the command with all problems of all files.

    Args:
        paths: The files.
        load: Loads a file.
        wanted: What the files are: `A_CONFIG` or `A_PLAN`; each loads what it is without it.
    """
    contents: dict[Path, T] = {}
    problems: list[str] = []
    for path in paths:
        try:
            contents[path] = load(path)
        except ConfigError as error:
            problems += _problem_lines(path, error, wanted)
    refuse(problems)
    return contents


def refuse(problems: Iterable[str]) -> None:
    """End the command with exit code 2 if there are problems; each is printed once."""
    # So an error of the command line is printed once, not once for each file.
    lines = dict.fromkeys(problems)
    if lines:
        raise Failed(exit_codes.USAGE, *lines)


def load_configs(
    paths: Iterable[Path], changes: Sequence[str], *, allow_python: bool | None = False
) -> dict[Path, Config]:
    """Load configs, and print their errors or warnings.

    Args:
        paths: The files of the configs.
        changes: Texts `key=value` that replace single values.
        allow_python: Whether the files of users' elements may be run; None if the configs are only
            read.
    """
    load = (
        config_to_read if allow_python is None else partial(load_config, allow_python=allow_python)
    )
    configs = loaded(paths, lambda path: load(path, changes), A_CONFIG)
    print_warnings((str(path), config) for path, config in configs.items())
    return configs


def load_single_config(path: Path, changes: Sequence[str], *, allow_python: bool) -> Config:
    """Load a config, and print its errors or warnings.

    Args:
        path: The file of the config.
        changes: Texts `key=value` that replace single values.
        allow_python: Whether the files of users' elements may be run.
    """
    return load_configs([path], changes, allow_python=allow_python)[path]


def load_plans(
    paths: Iterable[Path],
    changes_of: Callable[[Path], Sequence[str]],
    *,
    allow_python: bool,
) -> "dict[Path, Plan]":
    """Load plans, or end the command with all their errors; their warnings are not printed.

    Args:
        paths: The files of the plans.
        changes_of: Returns the texts `key=value` that replace single values of a base.
        allow_python: Whether the files of users' elements may be run.
    """
    from rbstab.sweep.plan.load import load_plan

    return loaded(
        paths, lambda path: load_plan(path, changes_of(path), allow_python=allow_python), A_PLAN
    )


def print_warnings(configs: Iterable[tuple[str, Config]]) -> None:
    """Print the warnings about configs, each once with the first name that it has in messages."""
    warnings: dict[str, dict[str, None]] = {}
    for label, config in configs:
        for warning in config_warnings(config):
            warnings.setdefault(warning, {})[label] = None
    for warning, labels in warnings.items():
        more = f" and {len(labels) - 1} more" if len(labels) > 1 else ""
        say(f"warning: {next(iter(labels))}{more}: {warning}")


def load_members(
    paths: Iterable[Path],
    members: Sequence[int],
    changes: Sequence[str],
    output: Path,
    *,
    allow_python: bool,
) -> dict[tuple[str, str], Config]:
    """Load the configs of members of plans, or end the command with all problems.

    Args:
        paths: The plans.
        members: Numbers of their members.
        changes: Texts `key=value` that replace single values of the base.
        output: The folder of results. If it has the sweep of a plan, its engine is used.
        allow_python: Whether the files of users' elements may be run.

    Returns:
        The configs by two names: the label for messages, and the stem of the result file.
    """
    plans = load_plans(
        paths, lambda path: (*_engine_change(path, output), *changes), allow_python=allow_python
    )
    refuse(
        f"{path}: has no member {number} (expected 0 to {plan.members - 1})"
        for path, plan in plans.items()
        for number in members
        if number >= plan.members
    )
    configs = {
        (f"{path}, member {number}", f"{sweep_name(path)}-member{number}"): plan.config_of(number)
        for path, plan in plans.items()
        for number in dict.fromkeys(members)
    }
    print_warnings((label, config) for (label, _), config in configs.items())
    return configs


def _engine_change(path: Path, output: Path) -> tuple[str, ...]:
    """Return the change of a plan's base that sets its engine: that of its sweep or the fastest."""
    from rbstab.sweep.folder.sweep_folder import engine_of
    from rbstab.sweep.members.engines import fastest_engine

    # A plan in the folder of a sweep names its engine already.
    if is_in_sweep_folder(path):
        return ()
    return (f"integration.engine={engine_of(output / path.stem) or fastest_engine()}",)


def sweep_name(path: Path) -> str:
    """Return the name of a plan's sweep: the stem of its file, or the name of its sweep folder."""
    return path.absolute().parent.name if is_in_sweep_folder(path) else path.stem


def is_in_sweep_folder(path: Path) -> bool:
    """Whether a plan is the copy in the folder of its sweep; this copy names its engine.

    Raises:
        OSError: The disk reports an error.
    """
    from rbstab.sweep.folder.manifest import MANIFEST
    from rbstab.sweep.folder.sweep_folder import PLAN_FILE

    return path.name == PLAN_FILE and is_file(path.parent / MANIFEST)


def refuse_engine_change(changes: Iterable[str]) -> None:
    """Refuse a change of the engine by --set beside --engine, which replaces it.

    Raises:
        UsageError: A change sets the engine.
    """
    if any(text.partition("=")[0] == "integration.engine" for text in changes):
        raise click.UsageError("--set integration.engine has no effect here. Use only --engine.")


def _problem_lines(path: Path, error: ConfigError, wanted: str) -> list[str]:
    """Return one line for each problem of a file; a single line if it is a file of another kind."""
    from rbstab.sweep.plan.load import is_config, is_plan

    word = shell_word(path)
    if _is_result_file(path):
        what, way = "is the file of a result", f"look at it: rbstab show {word}"
    elif wanted == A_CONFIG and _tells(is_plan, path):
        what = "is the plan of a sweep"
        way = f"run all its members: rbstab sweep {word}; one: rbstab run {word} --member N"
    elif wanted == A_PLAN and _tells(is_config, path):
        what, way = "is a config", f"run it: rbstab run {word}"
    else:
        return [_naming_example(path, str(problem)) for problem in error.problems]
    return [
        str(ConfigProblem(Location(str(path)), "", what, f"expected {wanted or A_CONFIG}; {way}"))
    ]


def _tells(test: Callable[[Path], bool], path: Path) -> bool:
    with suppress(ConfigError):
        return test(path)
    return False


def _is_result_file(path: Path) -> bool:
    """Whether a path is the file of a result; if the disk reports an error, reading it says it."""
    with suppress(OSError):
        return path.suffix == RESULT_SUFFIX and is_file(path)
    return False


def _naming_example(path: Path, line: str) -> str:
    """Return a line about a missing file; if an example has its name, with how to copy that."""
    if BEGIN not in line:
        return line
    from rbstab.packaged.examples import names

    examples = [name for name in names() if name.rpartition("/")[2] == path.stem]
    return line.replace(BEGIN, f"`rbstab examples {examples[0]}` copies it") if examples else line
