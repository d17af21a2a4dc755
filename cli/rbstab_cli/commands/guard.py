"""`rbstab guard`."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rbstab_cli import exit_codes
from rbstab_cli.arguments.configs import load_all
from rbstab_cli.arguments.options import ALLOW_PYTHON, AS_JSON, CHANGES, REPLACE_FILE, output_file

if TYPE_CHECKING:
    from rbstab.experiment.tuning.guard import Guarded, RunOutcome


@click.command("guard")
@click.argument("config", metavar="CONFIG", type=click.Path(path_type=Path))
@output_file("File of the new config; CONFIG.yaml gives CONFIG_guarded.yaml in the working folder.")
@CHANGES
@ALLOW_PYTHON
@REPLACE_FILE
@AS_JSON
def command(
    config: Path,
    output: Path | None,
    changes: tuple[str, ...],
    allow_python: bool,
    force: bool,
    as_json: bool,
) -> None:
    """Find a barrier of θ2 with which every start is proved to converge.

    A barrier adds the energy ½ k tan² θ2. Stiffnesses k from 0.01 to 50,000 N m are tried until one
    is proved and the run of the config stays in the range; then some below it. Shows what the
    barrier changes in the run, and writes the config with it; a barrier in the given config is
    replaced. If no stiffness is found, the exit code is 3.
    """
    from rbstab_cli.motion_errors import motion_errors
    from rbstab_cli.output.text_file import check_target, write_text

    target = output or Path(f"{config.stem}_guarded.yaml")
    if target.resolve() == config.resolve():
        raise click.UsageError(f"{target} is the given config. Choose another file with -o.")
    check_target(target, force=force)
    ((path, loaded),) = load_all([config], changes, allow_python=allow_python).items()
    with motion_errors(path):
        from rbstab.experiment.tuning.guard import guard

        found = guard(loaded, _say)
    if found.config is not None:
        from rbstab.config.load import resolved_yaml

        write_text(target, resolved_yaml(found.config), force=force)
    _report(found, target, as_json=as_json)
    if found.config is None:
        click.echo(f"{path}: no barrier was found; nothing is written", err=True)
        raise click.exceptions.Exit(exit_codes.NOT_COMPLETED)
    click.echo(f"{path}: every start in the range converges: proved -> {target}", err=True)


def _say(stiffness: float, outcome: str) -> None:
    click.echo(f"k = {stiffness:g} N m: {outcome}", err=True)


def _report(found: "Guarded", target: Path, *, as_json: bool) -> None:
    if as_json:
        from rbstab_cli.output.json_output import print_json

        print_json(_data(found, target))
        return
    from rbstab_cli.output.tables import add_row, new_table, number, print_table

    table = new_table("quantity", "given", "guarded", numbers=("given", "guarded"))
    outcomes = [found.given, found.guarded] if found.guarded is not None else [found.given]
    stiffness = "none was found" if found.stiffness is None else number(found.stiffness)
    add_row(table, "barrier k [N m]", "-", stiffness)
    for label, field in _ROWS:
        shown = [_shown(outcome, field) for outcome in outcomes]
        add_row(table, label, *shown, *["-"] * (2 - len(shown)))
    print_table(table)


_ROWS = (
    ("status", "status"),
    ("largest |θ2| [rad]", "largest_pitch"),
    ("v below v(0)/1000 from [s]", "settling_time"),
    ("largest couple of the barrier [N m]", "largest_couple"),
)


def _shown(outcome: "RunOutcome", field: str) -> str:
    from rbstab_cli.output.tables import number

    value = getattr(outcome, field)
    if field == "status":
        return str(value)
    return "not in this run" if math.isnan(value) else number(value)


def _data(found: "Guarded", target: Path) -> dict[str, Any]:
    return {
        "file": None if found.config is None else str(target),
        "stiffness": found.stiffness,
        "tried": [{"stiffness": k, "outcome": outcome} for k, outcome in found.tried],
        "given": found.given._asdict(),
        "guarded": None if found.guarded is None else found.guarded._asdict(),
    }
