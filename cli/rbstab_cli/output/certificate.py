"""The certificate of a run, as data and as a table."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rbstab.store.result import Result

VIOLATED = "violated"


def certificate_checks(result: "Result") -> list[dict[str, Any]]:
    """Return the checks of the certificate; none if the result has no certificate."""
    from rbstab.experiment.stored_certificate import certificate_lines

    return [line._asdict() for line in certificate_lines(result)]


def print_certificate(result: "Result") -> None:
    """Print the checks as a table."""
    from rbstab_cli.output.tables import add_row, new_table, number, print_table

    checks = certificate_checks(result)
    if not checks:
        return
    table = new_table("check", "verdict", "what was found", "value", "bound", "at [s]")
    for check in checks:
        when = number(check["when"]) if check["when"] == check["when"] else "-"
        values = (number(check["value"]), number(check["bound"]), when)
        style = "red" if check["verdict"] == VIOLATED else None
        add_row(table, check["check"], check["verdict"], check["quantity"], *values, style=style)
    print_table(table)
