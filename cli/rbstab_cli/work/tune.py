"""`rbstab tune`: scaled gains that minimize an objective."""

import math
from pathlib import Path
from typing import Any

import click

from rbstab.config.load import resolved_yaml
from rbstab.experiment.answers.rounded import number
from rbstab.experiment.tuning.tune import Tuned
from rbstab.experiment.tuning.tune import tune as tuned
from rbstab_cli import exit_codes
from rbstab_cli.inputs import load_single_config
from rbstab_cli.output.files import new_config, write_file
from rbstab_cli.output.progress import working
from rbstab_cli.printing import Table, print_json, say


def tune(
    config: Path,
    objective: str,
    overs: tuple[str, ...],
    bounds: str,
    output: Path | None,
    changes: tuple[str, ...],
    allow_python: bool,
    force: bool,
    as_json: bool,
) -> int:
    """Search for better gains, write the config with them, and print what was found.

    Args:
        config: The file of the config.
        objective: The quantity to minimize, a key of `OBJECTIVES`.
        overs: Texts of keys of gains, separated by commas.
        bounds: LOW:HIGH, the smallest and the largest factor on the gains.
        output: The file of the new config; None: it is named after the config.
        changes: Texts `key=value` that replace single values of the config.
        allow_python: Whether the files of users' elements may be run.
        force: Whether an existing file is replaced.
        as_json: Whether to print JSON.
    """
    factors = _bounds(bounds)
    target = new_config(config, output, "_tuned", force=force)
    loaded = load_single_config(config, changes, allow_python=allow_python)
    with working(f"{config.name}: tuning"):
        tuning = tuned(loaded, objective, ",".join(overs).split(","), factors)
    if tuning.better:
        write_file(target, resolved_yaml(tuning.config), force=force)
    if as_json:
        print_json(_data(tuning, target))
    else:
        _print(tuning)
    if tuning.better:
        say(f"{config}: found a better config -> {target}")
    elif math.isfinite(tuning.value):
        say(f"{config}: no better config was found; nothing is written")
    else:
        say(f"{config}: no run completed and settled; nothing is written")
        return exit_codes.NOT_COMPLETED
    return exit_codes.OK


def _bounds(text: str) -> tuple[float, float]:
    low, _, high = text.partition(":")
    try:
        bounds = float(low), float(high)
    except ValueError:
        bounds = math.nan, math.nan
    if not 0 < bounds[0] <= 1 <= bounds[1] < math.inf:
        wanted = f"'{text}' (expected LOW:HIGH with 0 < LOW <= 1 <= HIGH)"
        raise click.BadParameter(wanted, param_hint="'--bounds'")
    return bounds


def _print(tuning: Tuned) -> None:
    numbers = ("given", "tuned", "factor")
    table = Table("quantity", *numbers, numbers=numbers)
    objective = tuning.objective
    # The objective of a run that fails, or does not settle, is infinite.
    values = [
        number(value) if math.isfinite(value) else "not in this run"
        for value in (tuning.given, tuning.value)
    ]
    ratio = "-" if tuning.given in {0.0, math.inf} else number(tuning.value / tuning.given)
    table.add(f"{objective.name} {objective.symbol} [{objective.unit}]", *values, ratio)
    for scaling, factor in zip(tuning.scalings, tuning.factors, strict=True):
        for entry in scaling.entries:
            gains = (entry.value, entry.value * factor)
            table.add(entry.key, *(number(gain, 6) for gain in gains), number(factor))
    table.print()
    say(f"{tuning.runs} runs, {tuning.failures} of them failed")


def _data(tuning: Tuned, target: Path) -> dict[str, Any]:
    return {
        "file": str(target) if tuning.better else None,
        "objective": tuning.objective.name,
        "unit": tuning.objective.unit,
        "given": tuning.given,
        "tuned": tuning.value,
        "better": tuning.better,
        "factors": dict(zip((s.key for s in tuning.scalings), tuning.factors, strict=True)),
        "runs": tuning.runs,
        "failures": tuning.failures,
    }
