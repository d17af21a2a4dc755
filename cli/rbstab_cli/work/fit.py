"""`rbstab fit`: numbers of a config from a measured motion."""

from pathlib import Path
from typing import Any

import click

from rbstab.config.load import resolved_yaml
from rbstab.experiment.answers.rounded import number
from rbstab.experiment.tuning.fit import fit as fitted
from rbstab_cli import exit_codes
from rbstab_cli.inputs import load_single_config, loaded, print_warnings
from rbstab_cli.output.files import figure_form, new_config, write_file
from rbstab_cli.output.progress import working
from rbstab_cli.printing import Table, print_json, say

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
    """Fit the numbers, write the config with them, and print what was found.

    Args:
        config: The file of the config.
        data: The CSV file of the measured motion.
        frees: Texts of keys to fit, separated by commas.
        output: The file of the new config; None: it is named after the config.
        figure: The file of a figure of the fit; None: none is drawn.
        changes: Texts `key=value` that replace single values of the config.
        allow_python: Whether the files of users' elements may be run.
        force: Whether existing files are replaced.
        as_json: Whether to print JSON.
    """
    target = new_config(config, output, "_fitted", force=force)
    form = "" if figure is None else figure_form("--figure", figure, force=force)
    files = [file.resolve() for file in (config, data, target, figure) if file is not None]
    if len({*files}) < len(files):
        raise click.UsageError("CONFIG, DATA, -o and --figure: expected different files")
    given = load_single_config(config, changes, allow_python=allow_python)
    keys = [key.strip() for key in ",".join(frees).split(",")]
    with working(f"{config.name}: fitting"):
        # So all problems of the file are told.
        best_fit = loaded([data], lambda path: fitted(given, path, keys), "a measured motion")[data]
    if best_fit.is_minimum:
        write_file(target, resolved_yaml(best_fit.config), force=force)
    if figure is not None:
        # Imported late: few calls draw.
        from rbstab.report.runs.figures.fitted import fitted_figure
        from rbstab.report.writers.figure_files import figure_bytes

        write_file(figure, figure_bytes(fitted_figure(best_fit), form), force=force)
        say(f"-> {figure}")
    tables: dict[str, Any] = {"numbers": best_fit.numbers, "columns": best_fit.columns}
    if as_json:
        rows = {name: [row._asdict() for row in table] for name, table in tables.items()}
        file = str(target) if best_fit.is_minimum else None
        outcome = {"is_minimum": best_fit.is_minimum, "warnings": best_fit.warnings}
        print_json({"file": file, **rows, **outcome})
    else:
        for title, table in tables.items():
            heads = table[0]._fields[2:]
            printed = Table(title, *heads, numbers=heads)
            for name, unit, *values in table:
                printed.add(f"{name} [{unit}]", *(number(value, 5) for value in values))
            printed.print(NOTES[title])
    for warning in best_fit.warnings:
        say(f"warning: {data}: {warning}")
    # What fits best may be no real body.
    print_warnings([(str(target), best_fit.config)])
    if not best_fit.is_minimum:
        say(f"{config}: no minimum was found; try other values to start from; no config is written")
        return exit_codes.NOT_COMPLETED
    say(f"{config}: fitted -> {target}")
    return exit_codes.OK
