"""`rbstab sensitivities`: derivatives of a run, as tables or as JSON."""

from pathlib import Path
from typing import Any

from rbstab.experiment.answers.rounded import number
from rbstab.experiment.tuning.sensitivities import Sensitivities
from rbstab.experiment.tuning.sensitivities import sensitivities as derivatives_of
from rbstab_cli.inputs import load_single_config
from rbstab_cli.output.files import check_target, write_file
from rbstab_cli.output.progress import working
from rbstab_cli.printing import Table, as_json_text, print_json, say

IN_TABLES = ("settling_time", *(f"peak_contact_displacement[{axis}]" for axis in range(3)))
"""Quantities in the tables; the JSON has all."""


def sensitivities(
    config: Path,
    changes: tuple[str, ...],
    allow_python: bool,
    as_json: bool,
    output: Path | None,
    force: bool,
) -> None:
    """Compute the derivatives and print them.

    Args:
        config: The file of the config.
        changes: Texts `key=value` that replace single values of the config.
        allow_python: Whether the files of users' elements may be run.
        as_json: Whether to print JSON.
        output: The file of the JSON; None: none is written.
        force: Whether an existing file is replaced.
    """
    if output is not None:
        check_target(output, force=force)
    loaded = load_single_config(config, changes, allow_python=allow_python)
    with working(f"{config.name}: sensitivities"):
        sensitivity = derivatives_of(loaded)
    if not sensitivity.settles:
        say(f"{config}: the run does not settle, so it has no settling time")
    data = {"config": str(config), "title": loaded.title, **_data(sensitivity)}
    if output is not None:
        write_file(output, as_json_text(data) + "\n", force=force)
    if as_json:
        print_json(data)
    else:
        _print_tables(sensitivity)


def _data(sensitivity: Sensitivities) -> dict[str, Any]:
    names = [quantity.name for quantity in sensitivity.quantities]
    rows = zip(
        sensitivity.entries,
        sensitivity.derivatives.tolist(),
        sensitivity.relative.tolist(),
        strict=True,
    )
    return {
        "quantities": [
            {**quantity._asdict(), "value": value}
            for quantity, value in zip(
                sensitivity.quantities, sensitivity.values.tolist(), strict=True
            )
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


def _print_tables(sensitivity: Sensitivities) -> None:
    shown = [quantity for quantity in sensitivity.quantities if quantity.name in IN_TABLES]
    columns = [sensitivity.column(quantity.name) for quantity in shown]
    table = Table("quantity", "value", numbers=("value",))
    for quantity, column in zip(shown, columns, strict=True):
        table.add(f"{quantity.name} [{quantity.unit}]", number(sensitivity.values[column]))
    table.print()
    names = [quantity.name.replace("contact_displacement", "E") for quantity in shown]
    units = [f" [{quantity.unit}]" for quantity in shown]
    order = sensitivity.by_importance([quantity.name for quantity in shown])
    for title, values, ends in (
        ("relative", sensitivity.relative, [""] * len(shown)),
        ("per unit", sensitivity.derivatives, units),
    ):
        first = f"{title}: parameter"
        numbers = ("value", *map(str.__add__, names, ends))
        table = Table(first, *numbers, words=(first,), numbers=numbers)
        for index in order:
            entry = sensitivity.entries[index]
            cells = [number(values[index, column], 3) for column in columns]
            table.add(entry.key, number(entry.value, 6), *cells)
        table.print()
