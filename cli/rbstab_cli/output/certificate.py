"""The certificate of a run, for people and machines."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rbstab.store.result import Result

VIOLATED = "violated"


def lines_of(result: "Result") -> list[dict[str, Any]]:
    """The lines of the certificate; none where the result has none."""
    from rbstab.experiment.stored_certificate import certificate_lines

    return [line._asdict() for line in certificate_lines(result)]


def show_certificate(result: "Result") -> None:
    """Prints the lines as a table."""
    from rbstab_cli.output.tables import number, row, show, table

    lines = lines_of(result)
    if not lines:
        return
    made = table("check", "verdict", "what was found", "value", "bound", "at [s]")
    for line in lines:
        when = number(line["when"]) if line["when"] == line["when"] else "-"
        values = (number(line["value"]), number(line["bound"]), when)
        style = "red" if line["verdict"] == VIOLATED else None
        row(made, line["check"], line["verdict"], line["quantity"], *values, style=style)
    show(made)
