"""`rbstab tune`."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rbstab.experiment.tuning.objective import OBJECTIVES
from rbstab_cli import exit_codes
from rbstab_cli.arguments.configs import CHANGES, load_all

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
    type=click.Choice(list(OBJECTIVES)),
    help="What is to be small: "
    + "; ".join(f"{o.name}, {o.meaning} [{o.unit}]" for o in OBJECTIVES.values())
    + ".",
)
@click.option(
    "--over",
    required=True,
    metavar="KEY,...",
    help="What is scaled: controller.L_c as a whole, or controller.L_c[0] of a diagonal.",
)
@click.option(
    "--bounds",
    default="0.1:10",
    show_default=True,
    metavar="LOW:HIGH",
    callback=_bounds,
    help="The least and the largest factor on the given values.",
)
@click.option(
    "-o",
    "--output",
    metavar="FILE",
    type=click.Path(dir_okay=False, path_type=Path),
    help="The new config; CONFIG.yaml gives CONFIG_tuned.yaml in the working folder.",
)
@CHANGES
@click.option("--force", is_flag=True, help="Replace the new config's file if it is there.")
@click.option("--json", "as_json", is_flag=True, help="Print what was found as JSON.")
def command(
    config: Path,
    objective: str,
    over: str,
    bounds: tuple[float, float],
    output: Path | None,
    changes: tuple[str, ...],
    force: bool,
    as_json: bool,
) -> None:
    """Scale gains so that an objective of the run becomes small.

    Tries configs all over the bounds, then follows exact gradients from the given one and from the
    best, and writes the best that it met as a new config, which is never worse than the given one.
    Nothing is written where nothing better is found. A run that does not complete, or does not
    settle, counts as worst; if there is no other, the exit code is 3.
    """
    from rbstab_cli.motion_errors import said_of
    from rbstab_cli.output.text_file import refuse_taken, write_text

    target = output or Path(f"{config.stem}_tuned.yaml")
    if target.resolve() == config.resolve():
        raise click.UsageError(f"{target} is the given config; choose another file with -o")
    refuse_taken(target, force=force)
    ((path, loaded),) = load_all([config], changes).items()
    with said_of(path):
        from rbstab.experiment.tuning.tune import tune

        found = tune(loaded, objective, over.split(","), bounds)
    if found.better:
        from rbstab.config.load import resolved_yaml

        write_text(target, resolved_yaml(found.config), force=force)
    _report(found, target, as_json=as_json)
    if found.better:
        click.echo(f"{path}: better -> {target}", err=True)
    elif math.isfinite(found.value):
        click.echo(f"{path}: nothing better was found; no config is written", err=True)
    else:
        click.echo(f"{path}: no run completed and settled; no config is written", err=True)
        raise click.exceptions.Exit(exit_codes.NOT_COMPLETED)


def _report(found: "Tuned", target: Path, *, as_json: bool) -> None:
    if as_json:
        from rbstab_cli.output.json_output import print_json

        print_json(_facts(found, target))
        return
    from rbstab_cli.output.tables import number, row, show, table

    made = table("quantity", "given", "tuned", "factor", numbers=("given", "tuned", "factor"))
    objective = found.objective
    ratio = found.value / found.given if math.isfinite(found.given) else math.nan
    name = f"{objective.name} {objective.symbol} [{objective.unit}]"
    row(made, name, *(number(value) for value in (found.given, found.value, ratio)))
    for design, factor in zip(found.designs, found.factors, strict=True):
        for entry in design.entries:
            values = (entry.value, entry.value * factor)
            row(made, entry.key, *(number(value, 6) for value in values), number(factor))
    show(made)
    click.echo(f"{found.runs} runs, {found.failures} of them failed", err=True)


def _facts(found: "Tuned", target: Path) -> dict[str, Any]:
    return {
        "file": str(target) if found.better else None,
        "objective": found.objective.name,
        "unit": found.objective.unit,
        "given": found.given,
        "tuned": found.value,
        "better": found.better,
        "factors": dict(zip((d.key for d in found.designs), found.factors, strict=True)),
        "runs": found.runs,
        "failures": found.failures,
    }
