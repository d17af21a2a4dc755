"""`rbstab show`."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rbstab_cli import exit_codes

if TYPE_CHECKING:
    from rbstab.experiment.summary import Comparison
    from rbstab.store.result import Result


@click.command("show")
@click.argument("result", metavar="RESULT", type=click.Path(path_type=Path))
@click.option("--json", "as_json", is_flag=True, help="Print everything but the arrays as JSON.")
@click.option(
    "--config", "as_config", is_flag=True, help="Print the stored config alone; it runs as it is."
)
def command(result: Path, as_json: bool, as_config: bool) -> None:
    """Show what a result holds.

    Prints how the run ended, its Lyapunov function and audit, its final state, the printed values
    of its reference beside the computed ones, the arrays in the file, and where it comes from.
    """
    from rbstab.store.errors import StoreError
    from rbstab.store.run_file import open_result

    if as_json and as_config:
        raise click.UsageError("expected either --json or --config")
    try:
        opened = open_result(result)
    except StoreError as error:
        click.echo(f"error: {error}", err=True)
        raise click.exceptions.Exit(exit_codes.STORAGE) from error
    if as_config:
        click.echo(opened.config, nl=False)
    elif as_json:
        _print_json(opened)
    else:
        _print_tables(opened)


def _comparisons(result: "Result") -> tuple[str, list["Comparison"]]:
    """Where the reference of the stored config comes from, and its values beside the computed."""
    from rbstab.experiment.stored_config import stored_config
    from rbstab.experiment.summary import comparisons_of

    # A file that another version of the program wrote is still worth showing.
    config = stored_config(result).config
    reference = config.reference if config is not None else None
    if reference is None:
        return "", []
    note = f" ({reference.note})" if reference.note else ""
    return reference.source + note, comparisons_of(result, reference)


def _print_json(result: "Result") -> None:
    from rbstab_cli.output.certificate import lines_of
    from rbstab_cli.output.facts import facts_of
    from rbstab_cli.output.json_output import print_json

    source, comparisons = _comparisons(result)
    arrays: dict[str, Any] = {
        name: {"dimensions": v.dimensions, "shape": v.data.shape, "units": v.unit}
        for name, v in result.variables.items()
    }
    reference = {"source": source, "values": [c._asdict() for c in comparisons]}
    facts = {"certificate": lines_of(result), "final": _final(result), "reference": reference}
    print_json({**facts_of(result), **facts, "arrays": arrays, "config": result.config})


def _final(result: "Result") -> dict[str, list[float]]:
    names = ("orientation", "angular_velocity", "position", "velocity", "connector_state")
    return {name: result[name][-1].tolist() for name in names if name in result}


def _print_tables(result: "Result") -> None:
    from rbstab.experiment.summary import summary_of
    from rbstab_cli.output.certificate import show_certificate
    from rbstab_cli.output.tables import number, row, show, table

    s, attributes = summary_of(result), result.attributes
    made = table("quantity", "value")
    row(made, "title", str(attributes["title"]))
    detail = f": {attributes['status_detail']}" if attributes.get("status_detail") else ""
    row(made, "status", result.status + detail)
    row(made, "verdict", str(attributes.get("verdict", "-")))
    row(made, "v(0), v(end)", f"{number(s.lyapunov_start, 7)} J, {number(s.lyapunov_end, 7)} J")
    row(made, "max |r| / v(0)", number(s.relative_residual, 2))
    row(made, "peak E by axis", _vector(s.peak_contact_displacement) + " m")
    row(made, "max |θ2|", f"{number(s.largest_pitch)} rad")
    for name, value in _final(result).items():
        row(made, f"final {name}", f"{_vector(value)} {result.variables[name].unit}")
    for warning in str(attributes.get("warnings", "")).splitlines():
        row(made, "warning", warning, style="yellow")
    show(made)
    show_certificate(result)
    _print_reference(result)
    made = table("array", "dimensions", "unit", "what it is")
    for name, variable in result.variables.items():
        dimensions = ", ".join(variable.dimensions) or "-"
        row(made, name, dimensions, variable.unit, variable.long_name)
    show(made)
    made = table("provenance", "value")
    for name in [name for name in attributes if name not in _SHOWN_ABOVE]:
        row(made, name, str(attributes[name]))
    show(made)


_SHOWN_ABOVE = ("title", "status", "status_detail", "verdict", "warnings")


def _print_reference(result: "Result") -> None:
    from rbstab.config.errors import printable
    from rbstab_cli.output.tables import row, show, table

    source, comparisons = _comparisons(result)
    if not comparisons:
        return
    click.echo(f"Reference: {printable(source)}")
    made = table("quantity", "printed", "computed")
    for c in comparisons:
        row(made, f"{c.name} [{c.unit}]", _vector(c.printed), _vector(c.computed))
    show(made)


def _vector(values: Any) -> str:
    return "(" + ", ".join(f"{value:.4g}" for value in values) + ")"
