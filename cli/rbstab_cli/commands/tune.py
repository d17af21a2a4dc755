"""`rbstab tune`."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rbstab.experiment.tuning.objective import OBJECTIVES
from rbstab_cli import exit_codes
from rbstab_cli.arguments.choice import Choice
from rbstab_cli.arguments.configs import load_all
from rbstab_cli.arguments.options import (
    ALLOW_PYTHON,
    AS_JSON,
    CHANGES,
    QUIET,
    REPLACE_FILE,
    output_file,
)

if TYPE_CHECKING:
    from rbstab.experiment.tuning.tune import Tuned


def _bounds(_context: click.Context, _parameter: click.Parameter, text: str) -> tuple[float, float]:
    low, _, high = text.partition(":")
    try:
        bounds = float(low), float(high)
    except ValueError:
        bounds = math.nan, math.nan
    if not 0 < bounds[0] <= 1 <= bounds[1] < math.inf:
        raise click.BadParameter(f"'{text}' (expected LOW:HIGH with 0 < LOW <= 1 <= HIGH)")
    return bounds


@click.command("tune")
@click.argument("config", metavar="CONFIG", type=click.Path(path_type=Path))
@click.option(
    "--objective",
    required=True,
    type=Choice(list(OBJECTIVES)),
    help="The quantity to minimize: "
    + "; ".join(f"{o.name}, {o.meaning} [{o.unit}]" for o in OBJECTIVES.values())
    + ".",
)
@click.option(
    "--over",
    "overs",
    multiple=True,
    required=True,
    metavar="KEY,...",
    help="Gains to scale: all of controller.L_c, or the diagonal entry controller.L_c[0]. "
    "Repeatable.",
)
@click.option(
    "--bounds",
    default="0.1:10",
    show_default=True,
    metavar="LOW:HIGH",
    callback=_bounds,
    help="The smallest and the largest factor on the given gains.",
)
@output_file("File of the new config; CONFIG.yaml gives CONFIG_tuned.yaml in the working folder.")
@CHANGES
@ALLOW_PYTHON
@REPLACE_FILE
@AS_JSON
@QUIET
def command(
    config: Path,
    objective: str,
    overs: tuple[str, ...],
    bounds: tuple[float, float],
    output: Path | None,
    changes: tuple[str, ...],
    allow_python: bool,
    force: bool,
    as_json: bool,
    quiet: bool,
) -> None:
    """Scale gains to minimize an objective of the run.

    Samples configs within the bounds, then descends along exact gradients from the given config and
    from the best sample. Writes the best config found; if none is better than the given one, writes
    nothing. A run that does not complete or does not settle counts as worst; if no run completes
    and settles, the exit code is 3. Gradients need heyoka, also for a config with another engine.
    """
    from rbstab_cli.motion_errors import motion_errors
    from rbstab_cli.output.progress import working
    from rbstab_cli.output.text_file import check_target, write_text

    target = output or Path(f"{config.stem}_tuned.yaml")
    if target.resolve() == config.resolve():
        raise click.UsageError(f"{target} is the given config. Choose another file with -o.")
    check_target(target, force=force)
    ((path, loaded),) = load_all([config], changes, allow_python=allow_python).items()
    with motion_errors(path), working(f"{path.name}: tuning", wanted=not quiet):
        from rbstab.experiment.tuning.tune import tune

        found = tune(loaded, objective, ",".join(overs).split(","), bounds)
    if found.better:
        from rbstab.config.load import resolved_yaml

        write_text(target, resolved_yaml(found.config), force=force)
    _report(found, target, as_json=as_json)
    if found.better:
        click.echo(f"{path}: found a better config -> {target}", err=True)
    elif math.isfinite(found.value):
        click.echo(f"{path}: no better config was found; nothing is written", err=True)
    else:
        click.echo(f"{path}: no run completed and settled; nothing is written", err=True)
        raise click.exceptions.Exit(exit_codes.NOT_COMPLETED)


def _report(found: "Tuned", target: Path, *, as_json: bool) -> None:
    if as_json:
        from rbstab_cli.output.json_output import print_json

        print_json(_tuning_data(found, target))
        return
    from rbstab_cli.output.tables import add_row, new_table, number, print_table

    table = new_table("quantity", "given", "tuned", "factor", numbers=("given", "tuned", "factor"))
    objective = found.objective
    # The objective of a run that fails, or does not settle, is infinite.
    given, tuned = (
        number(value) if math.isfinite(value) else "not in this run"
        for value in (found.given, found.value)
    )
    ratio = "-" if found.given in {0.0, math.inf} else number(found.value / found.given)
    add_row(table, f"{objective.name} {objective.symbol} [{objective.unit}]", given, tuned, ratio)
    for scaling, factor in zip(found.scalings, found.factors, strict=True):
        for entry in scaling.entries:
            values = (entry.value, entry.value * factor)
            add_row(table, entry.key, *(number(value, 6) for value in values), number(factor))
    print_table(table)
    click.echo(f"{found.runs} runs, {found.failures} of them failed", err=True)


def _tuning_data(found: "Tuned", target: Path) -> dict[str, Any]:
    return {
        "file": str(target) if found.better else None,
        "objective": found.objective.name,
        "unit": found.objective.unit,
        "given": found.given,
        "tuned": found.value,
        "better": found.better,
        "factors": dict(zip((s.key for s in found.scalings), found.factors, strict=True)),
        "runs": found.runs,
        "failures": found.failures,
    }
