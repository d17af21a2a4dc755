"""`rbstab check`."""

from pathlib import Path

import click

from rbstab.files.counts import grouped
from rbstab_cli import exit_codes
from rbstab_cli.arguments.configs import load_all, print_plan_warnings
from rbstab_cli.arguments.options import ALLOW_PYTHON, CHANGES


@click.command("check")
@click.argument("configs", nargs=-1, metavar="[CONFIG]...", type=click.Path(path_type=Path))
@click.option(
    "--element",
    "elements",
    multiple=True,
    metavar="FILE",
    type=click.Path(path_type=Path),
    help="Run the Python file FILE, and test each of its element classes at random states. "
    "Repeatable.",
)
@CHANGES
@ALLOW_PYTHON
def command(
    configs: tuple[Path, ...],
    elements: tuple[Path, ...],
    changes: tuple[str, ...],
    allow_python: bool,
) -> None:
    """Check configs and plans and list their errors, or test elements of your own.

    If every CONFIG is valid, prints one line for each: variant, coordinates, engine and run id; of
    the plan of a sweep its members, variants and id. Otherwise prints all errors as
    FILE:LINE:COLUMN: KEY: PROBLEM (EXPECTED); the exit code is 2.

    With --element, says of each statement of each class whether it holds: its kinds of number, its
    power balance, its dissipation (see docs/own_elements.md). If one does not, the exit code is 2.
    """
    from rbstab.config.load import run_id
    from rbstab.report.reading.not_results import PLAN, what_it_is

    if not configs and not elements:
        raise click.UsageError("expected CONFIG or --element FILE")
    if not configs and (changes or allow_python):
        option = "--set" if changes else "--allow-python"
        raise click.UsageError(f"{option} has no effect without CONFIG")
    plans = [path for path in configs if what_it_is(path) == PLAN]
    facts, problems = _checked_plans(plans, changes, allow_python=allow_python)
    rest = [path for path in configs if path not in plans]
    loaded = load_all(rest, changes, allow_python=allow_python, problems=problems)
    for path, config in loaded.items():
        variant, integration = config.controller.variant, config.integration
        facts[path] = (
            f"{variant}, coordinates {integration.coordinates}, engine {integration.engine}, "
            f"run id {run_id(config)}"
        )
    for path in dict.fromkeys(configs):
        click.echo(f"{path}: valid: {facts[path]}")
    # Each file is tested, also after one that is wrong.
    wrong = [path for path in elements if not _holds(path)]
    if wrong:
        raise click.exceptions.Exit(exit_codes.USAGE)


def _checked_plans(
    paths: list[Path], changes: tuple[str, ...], *, allow_python: bool
) -> tuple[dict[Path, str], list[str]]:
    """Return what is to be said of each valid plan, and the problems of the others."""
    from rbstab.config.errors import ConfigError
    from rbstab.report.reading.not_results import PLAN
    from rbstab.sweep.plan.load import load_plan
    from rbstab.sweep.plan.plan import plan_id
    from rbstab_cli.arguments.plans import plan_problem_lines

    facts: dict[Path, str] = {}
    problems: dict[str, None] = {}
    for path in paths:
        try:
            plan = load_plan(path, changes, allow_python=allow_python)
        except ConfigError as error:
            problems.update(dict.fromkeys(plan_problem_lines(path, error)))
            continue
        print_plan_warnings(path, plan)
        members = f"{grouped(plan.members)} member{'' if plan.members == 1 else 's'}"
        facts[path] = f"{PLAN}, {members}, {', '.join(plan.variants)}, sweep id {plan_id(plan)}"
    return facts, list(problems)


def _holds(path: Path) -> bool:
    """Print what was found in a file with elements, and return whether all of it holds."""
    from rbstab.experiment.element_check.check import STATES, ElementFileError, check_file

    try:
        classes = check_file(path)
    except ElementFileError as error:
        click.echo(f"{path}: {error}", err=True)
        return False
    for checked in classes:
        count = len(checked.problems)
        verdict = f"{count} statement{'s do' if count > 1 else ' does'} not hold"
        if not count:
            verdict = f"all statements hold at {STATES} random states"
        click.echo(f"{path}: {checked.name}: {verdict}")
        for sign, texts in (
            ("holds", checked.passed),
            ("WRONG", checked.problems),
            ("note ", checked.notes),
        ):
            for text in texts:
                click.echo(f"  {sign}  {text}")
    return not any(checked.problems for checked in classes)
