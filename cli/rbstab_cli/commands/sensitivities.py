"""`rbstab sensitivities`."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rbstab_cli.arguments.configs import CHANGES, load_all

if TYPE_CHECKING:
    from rbstab.experiment.tuning.sensitivities import Sensitivities

SHOWN = ("settling_time", *(f"peak_contact_displacement[{axis}]" for axis in range(3)))
"""The quantities in the tables; the others are in the JSON."""


@click.command("sensitivities")
@click.argument("config", metavar="CONFIG", type=click.Path(path_type=Path))
@CHANGES
@click.option("--json", "as_json", is_flag=True, help="Print everything as JSON.")
@click.option(
    "-o",
    "--output",
    metavar="FILE",
    type=click.Path(dir_okay=False, path_type=Path),
    help="Write the JSON to a file, too.",
)
@click.option("--force", is_flag=True, help="Replace the file if it is there.")
def command(
    config: Path, changes: tuple[str, ...], as_json: bool, output: Path | None, force: bool
) -> None:
    """Say how a run depends on its gains, its body and its start.

    Prints the derivatives of the settling time (when v falls below v(0)/1000 for good) and of the
    value of E farthest from zero by axis with respect to every gain, the mass, the inertia, the
    contact point and the initial state, those first that matter most: relative, in % for 1 %, then
    per unit of the parameter. An entry beside the diagonal of a matrix stands for both of its
    places. --json adds the times of the peaks and the final state.

    Exact derivatives by variational equations, compiled by heyoka, whatever the engine of the
    config; not for a sliding connector, whose motion is not smooth.
    """
    from rbstab_cli.motion_errors import said_of
    from rbstab_cli.output.text_file import refuse_taken, write_text

    if output is not None:
        refuse_taken(output, force=force)
    ((path, loaded),) = load_all([config], changes).items()
    with said_of(path):
        from rbstab.experiment.tuning.sensitivities import sensitivities

        found = sensitivities(loaded)
    if not found.settles:
        click.echo(f"{path}: the run does not settle: it has no settling time", err=True)
    if as_json or output is not None:
        from rbstab_cli.output.json_output import as_json_text

        text = as_json_text({"config": str(path), "title": loaded.title, **_facts(found)})
        if output is not None:
            write_text(output, text + "\n", force=force)
        if as_json:
            click.echo(text)
            return
    _print_tables(found)


def _facts(found: "Sensitivities") -> dict[str, Any]:
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
    from rbstab_cli.output.tables import number, row, show, table

    quantities = [quantity for quantity in found.quantities if quantity.name in SHOWN]
    columns = [found.column(quantity.name) for quantity in quantities]
    made = table("quantity", "value", numbers=("value",))
    for quantity, column in zip(quantities, columns, strict=True):
        row(made, f"{quantity.name} [{quantity.unit}]", number(found.values[column]))
    show(made)
    order = found.by_importance([quantity.name for quantity in quantities])
    for title, table_of in (("relative", found.relative), ("per unit", found.derivatives)):
        names = [quantity.name.replace("contact_displacement", "E") for quantity in quantities]
        headers = [
            name if title == "relative" else f"{name} [{quantity.unit}]"
            for name, quantity in zip(names, quantities, strict=True)
        ]
        first = f"{title}: parameter"
        made = table(first, "value", *headers, words=(first,), numbers=("value", *headers))
        for index in order:
            entry = found.entries[index]
            cells = [number(table_of[index, column], 3) for column in columns]
            row(made, entry.key, number(entry.value, 6), *cells)
        show(made)
