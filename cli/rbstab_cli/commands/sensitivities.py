"""`rbstab sensitivities`."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rbstab_cli.arguments.configs import load_all
from rbstab_cli.arguments.options import ALLOW_PYTHON, CHANGES, QUIET, REPLACE_FILE, output_file

if TYPE_CHECKING:
    from rbstab.experiment.tuning.sensitivities import Sensitivities

IN_TABLES = ("settling_time", *(f"peak_contact_displacement[{axis}]" for axis in range(3)))
"""Quantities in the tables; the JSON has all."""


@click.command("sensitivities")
@click.argument("config", metavar="CONFIG", type=click.Path(path_type=Path))
@CHANGES
@ALLOW_PYTHON
@click.option("--json", "as_json", is_flag=True, help="Print all results as JSON.")
@output_file("Also write the JSON to FILE.")
@REPLACE_FILE
@QUIET
def command(
    config: Path,
    changes: tuple[str, ...],
    allow_python: bool,
    as_json: bool,
    output: Path | None,
    force: bool,
    quiet: bool,
) -> None:
    """Compute how a run depends on its gains, its body and its initial state.

    Prints derivatives of the settling time (after which v stays below v(0)/1000) and of the peak of
    E by axis (the value farthest from zero). They are taken with respect to every gain, the mass,
    the inertia, the contact point and the initial state; the most important come first. One table
    is relative, in % for 1 %; the other is per unit of the parameter. An off-diagonal entry of a
    symmetric matrix changes in both of its places. --json adds the times of the peaks and the final
    state.

    The derivatives are exact: they come from variational equations, which go through switches and
    impacts. They need heyoka, also for a config with another engine. A motion without derivatives,
    such as a chaotic one, is refused with the reason.
    """
    from rbstab_cli.motion_errors import motion_errors
    from rbstab_cli.output.progress import working
    from rbstab_cli.output.text_file import check_target, write_text

    if output is not None:
        check_target(output, force=force)
    ((path, loaded),) = load_all([config], changes, allow_python=allow_python).items()
    with motion_errors(path), working(f"{path.name}: sensitivities", wanted=not quiet):
        from rbstab.experiment.tuning.sensitivities import sensitivities

        found = sensitivities(loaded)
    if not found.settles:
        click.echo(f"{path}: the run does not settle, so it has no settling time", err=True)
    if as_json or output is not None:
        from rbstab_cli.output.json_output import as_json_text, print_json

        data = {"config": str(path), "title": loaded.title, **_sensitivity_data(found)}
        if output is not None:
            write_text(output, as_json_text(data) + "\n", force=force)
        if as_json:
            print_json(data)
            return
    _print_tables(found)


def _sensitivity_data(found: "Sensitivities") -> dict[str, Any]:
    names = [quantity.name for quantity in found.quantities]
    rows = zip(found.entries, found.derivatives.tolist(), found.relative.tolist(), strict=True)
    return {
        "quantities": [
            {**quantity._asdict(), "value": value}
            for quantity, value in zip(found.quantities, found.values.tolist(), strict=True)
        ],
        "parameters": [
            {
                "key": entry.key,
                "value": entry.value,
                "derivatives": dict(zip(names, derivatives, strict=True)),
                "relative": dict(zip(names, relative, strict=True)),
            }
            for entry, derivatives, relative in rows
        ],
    }


def _print_tables(found: "Sensitivities") -> None:
    from rbstab_cli.output.tables import add_row, new_table, number, print_table

    quantities = [quantity for quantity in found.quantities if quantity.name in IN_TABLES]
    columns = [found.column(quantity.name) for quantity in quantities]
    table = new_table("quantity", "value", numbers=("value",))
    for quantity, column in zip(quantities, columns, strict=True):
        add_row(table, f"{quantity.name} [{quantity.unit}]", number(found.values[column]))
    print_table(table)
    order = found.by_importance([quantity.name for quantity in quantities])
    for title, table_of in (("relative", found.relative), ("per unit", found.derivatives)):
        names = [quantity.name.replace("contact_displacement", "E") for quantity in quantities]
        headers = [
            name if title == "relative" else f"{name} [{quantity.unit}]"
            for name, quantity in zip(names, quantities, strict=True)
        ]
        first = f"{title}: parameter"
        table = new_table(first, "value", *headers, words=(first,), numbers=("value", *headers))
        for index in order:
            entry = found.entries[index]
            cells = [number(table_of[index, column], 3) for column in columns]
            add_row(table, entry.key, number(entry.value, 6), *cells)
        print_table(table)
