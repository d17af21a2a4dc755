"""Load members of plans as configs of single runs."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from rbstab_cli.arguments.configs import exit_on_problems, print_warnings
from rbstab_cli.arguments.plans import is_in_sweep_folder, sweep_name

if TYPE_CHECKING:
    from rbstab.config.schema import Config
    from rbstab.sweep.plan.plan import Plan

MEMBERS = click.option(
    "--member",
    "members",
    multiple=True,
    metavar="N",
    type=click.IntRange(0),
    help="Run member N of a plan, counted from 0; each CONFIG is then a plan. Repeatable.",
)
"""The option --member."""


def load_members(
    paths: Iterable[Path],
    members: Sequence[int],
    changes: Sequence[str],
    output: Path,
    *,
    allow_python: bool,
) -> dict[tuple[str, str], "Config"]:
    """Load the configs of members of plans.

    If there is any problem, print all problems and end the command with exit code 2.

    Args:
        paths: The plans.
        members: Numbers of their members.
        changes: Texts `key=value` that replace single values of the base.
        output: The folder of results. If it has the sweep of a plan, its engine is used.
        allow_python: Whether the files of users' elements may be run.

    Returns:
        The configs by two names: the label for messages, and the stem of the result file.
    """
    plans = _load_plans(paths, changes, output, allow_python=allow_python)
    exit_on_problems(
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
    print_warnings({label: config for (label, _), config in configs.items()})
    return configs


def _load_plans(
    paths: Iterable[Path], changes: Sequence[str], output: Path, *, allow_python: bool
) -> dict[Path, "Plan"]:
    from rbstab.config.errors import ConfigError, ConfigProblem, Location
    from rbstab.sweep.plan.load import is_plan, load_plan

    plans: dict[Path, Plan] = {}
    problems: dict[str, None] = {}
    for path in paths:
        try:
            if is_plan(path):
                own = (*_engine_change(path, output), *changes)
                plans[path] = load_plan(path, own, allow_python=allow_python)
            else:
                what, expected = "is not the plan of a sweep", "expected a plan, or no --member"
                problems[str(ConfigProblem(Location(str(path)), "", what, expected))] = None
        except ConfigError as error:
            problems.update(dict.fromkeys(map(str, error.problems)))
    exit_on_problems(problems)
    return plans


def _engine_change(path: Path, output: Path) -> tuple[str, ...]:
    """Return the change of a plan's base that sets its engine: that of its sweep, or the fastest.

    A plan in the folder of a sweep already names its engine, so it needs no change.
    """
    from rbstab.sweep.folder.sweep_folder import engine_of
    from rbstab.sweep.members.engines import fastest_engine

    if is_in_sweep_folder(path):
        return ()
    return (f"integration.engine={engine_of(output / path.stem) or fastest_engine()}",)
