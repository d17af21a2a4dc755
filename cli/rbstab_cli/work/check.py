"""`rbstab check`: the errors of configs and plans, or of elements of users."""

from pathlib import Path

import click

from rbstab.config.load import load_config, run_id
from rbstab.config.schema import Config
from rbstab.experiment.element_check.check import STATES, ElementFileError, check_file
from rbstab.report.model.words import counted
from rbstab.report.reading.kinds import Kind
from rbstab.sweep.plan.load import is_plan, load_plan
from rbstab.sweep.plan.plan import Plan, plan_id
from rbstab_cli import exit_codes
from rbstab_cli.inputs import loaded, print_warnings
from rbstab_cli.printing import say


def check(
    configs: tuple[Path, ...],
    elements: tuple[Path, ...],
    changes: tuple[str, ...],
    allow_python: bool,
) -> int:
    """Print a line for each valid file, and what holds of elements; or all errors.

    Args:
        configs: The files of configs and plans.
        elements: The Python files of elements.
        changes: Texts `key=value` that replace single values of the config.
        allow_python: Whether the files of users' elements may be run.
    """
    if not configs and not elements:
        raise click.UsageError("expected CONFIG or --element FILE")

    def load(path: Path) -> Config | Plan:
        load_it = load_plan if is_plan(path) else load_config
        return load_it(path, changes, allow_python=allow_python)

    contents = loaded(configs, load)
    print_warnings(
        (str(path), config)
        for path, content in contents.items()
        for config in (content.bases.values() if isinstance(content, Plan) else [content])
    )
    for path, content in contents.items():
        click.echo(f"{path}: valid: {_facts(content)}")
    # Each file is tested, also after one that is wrong.
    wrong = [path for path in elements if not _holds(path)]
    return exit_codes.USAGE if wrong else exit_codes.OK


def _facts(content: Config | Plan) -> str:
    """Return what is said of a valid config or plan."""
    if isinstance(content, Plan):
        members, variants = counted(content.members, "member"), ", ".join(content.variants)
        return f"{Kind.PLAN.words}, {members}, {variants}, sweep id {plan_id(content)}"
    variant, integration = content.controller.variant, content.integration
    return (
        f"{variant}, coordinates {integration.coordinates}, engine {integration.engine}, "
        f"run id {run_id(content)}"
    )


def _holds(path: Path) -> bool:
    """Print what was found in a file with elements, and return whether all of it holds."""
    try:
        classes = check_file(path)
    except ElementFileError as error:
        say(f"{path}: {error}")
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
