"""`rbstab fit`: numbers of a config from a measured motion."""

from functools import partial
from pathlib import Path
from typing import Any

from rbstab.config.files.measured import read_measured
from rbstab.config.load import resolved_yaml
from rbstab.experiment.answers.rounded import number
from rbstab.experiment.tuning.fit import fit as fitted
from rbstab_cli import exit_codes
from rbstab_cli.inputs import load_one, loaded
from rbstab_cli.output.files import new_config, write_file
from rbstab_cli.output.progress import working
from rbstab_cli.printing import Table, print_json, say
from rbstab_cli.work.stored.plot import figure_form

NOTES = {
    "numbers": "error: standard error; low, high: ends of the 95 % interval",
    "columns": "scatter: standard deviation of the residuals",
}


def fit(
    config: Path,
    data: Path,
    frees: tuple[str, ...],
    output: Path | None,
    figure: Path | None,
    changes: tuple[str, ...],
    allow_python: bool,
    force: bool,
    as_json: bool,
) -> int:
    """Fit the numbers, write the config with them, and print what was found."""
    target = new_config(config, output, "_fitted", force=force)
    form = "" if figure is None else figure_form("--figure", figure, force=force)
    given = load_one(config, changes, allow_python=allow_python)
    read = partial(read_measured, duration=given.integration.duration)
    measured = loaded([data], read, "a CSV file of a measured motion")[data]
    with working(f"{config.name}: fitting"):
        found = fitted(given, measured, ",".join(frees).split(","))
    if found.is_minimum:
        write_file(target, resolved_yaml(found.config), force=force)
    if figure is not None:
        # Imported late: few calls draw.
        from rbstab.report.runs.figures.fitted import fitted_figure
        from rbstab.report.writers.figure_files import figure_bytes

        write_file(figure, figure_bytes(fitted_figure(found), form), force=force)
        say(f"-> {figure}")
    tables = {
        name: [one._asdict() for one in rows]
        for name, rows in (("numbers", found.numbers), ("columns", found.columns))
    }
    if as_json:
        file = str(target) if found.is_minimum else None
        print_json({"file": file, **tables, "warnings": found.warnings, "runs": found.runs})
    else:
        for name, rows in tables.items():
            _print(name, rows)
    for warning in found.warnings:
        say(f"warning: {data}: {warning}")
    if not found.is_minimum:
        say(f"{config}: no minimum was found; try other values to start from; no config is written")
        return exit_codes.NOT_COMPLETED
    say(f"{config}: fitted -> {target}")
    return exit_codes.OK


def _print(title: str, rows: list[dict[str, Any]]) -> None:
    _, _, *heads = rows[0]
    table = Table(title, *heads, numbers=heads)
    for row in rows:
        table.add(f"{row['name']} [{row['unit']}]", *(number(row[head], 5) for head in heads))
    table.print(NOTES[title])
