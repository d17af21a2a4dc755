"""Members of plans as runs of a command line."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from rbstab_cli.arguments.configs import end_with, say_warnings
from rbstab_cli.arguments.plans import is_of_a_sweep, sweep_name

if TYPE_CHECKING:
    from rbstab.config.schema import Config
    from rbstab.sweep.plan.plan import Plan

MEMBERS = click.option(
    "--member",
    "members",
    multiple=True,
    metavar="N",
    type=click.IntRange(0),
    help="Run member N of a plan, from 0: the files are plans of sweeps. Repeatable.",
)
"""The option --member."""


def load_members(
    paths: Iterable[Path], members: Sequence[int], changes: Sequence[str], output: Path
) -> dict[tuple[str, str], "Config"]:
    """The configs of members of plans, by what messages call each, and the stem of its file.

    Prints everything that is wrong and ends the command with exit code 2 if there is anything.

    Args:
        paths: The plans.
        members: Numbers of their members.
        changes: Texts `key=value` that replace single values of the base.
        output: The folder of results, where a sweep may stand whose engine is taken.
    """
    plans = _plans(paths, changes, output)
    end_with(
        f"{path}: member {number} is not there (expected 0 to {plan.members - 1})"
        for path, plan in plans.items()
        for number in members
        if number >= plan.members
    )
    found = {
        (f"{path}, member {number}", f"{sweep_name(path)}-member{number}"): plan.config_of(number)
        for path, plan in plans.items()
        for number in dict.fromkeys(members)
    }
    say_warnings({label: config for (label, _), config in found.items()})
    return found


def _plans(paths: Iterable[Path], changes: Sequence[str], output: Path) -> dict[Path, "Plan"]:
    from rbstab.config.errors import ConfigError, Location, Problem
    from rbstab.sweep.plan.load import is_plan, load_plan

    plans: dict[Path, Plan] = {}
    problems: dict[str, None] = {}
    for path in paths:
        try:
            if is_plan(path):
                plans[path] = load_plan(path, (*_engine(path, output), *changes))
            else:
                what, expected = "is no plan of a sweep", "expected one, or no --member"
                problems[str(Problem(Location(str(path)), "", what, expected))] = None
        except ConfigError as error:
            problems.update(dict.fromkeys(map(str, error.problems)))
    end_with(problems)
    return plans


def _engine(path: Path, output: Path) -> tuple[str, ...]:
    """The engine with which `rbstab sweep` runs, or ran, a plan, as a change of its base."""
    from rbstab.sweep.folder.sweep_folder import engine_of
    from rbstab.sweep.members.engines import fastest

    if is_of_a_sweep(path):
        return ()
    return (f"integration.engine={engine_of(output / path.stem) or fastest()}",)
