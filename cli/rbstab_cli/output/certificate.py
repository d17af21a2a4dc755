"""The certificate of a run, as data and as a table."""

import math
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rbstab.store.result import Result

VIOLATED = "violated"


def certificate_checks(result: "Result") -> list[dict[str, Any]]:
    """Return the checks of the certificate; none if the result has no certificate.

    `word` says how sure each is, as in the table.
    """
    from rbstab.experiment.answers.check_words import word_of_check
    from rbstab.experiment.stored_certificate import certificate_lines

    return [{**line._asdict(), "word": word_of_check(line)} for line in certificate_lines(result)]


def print_certificate(result: "Result") -> None:
    """Print the checks as a table."""
    from rbstab.experiment.answers.check_words import comparison, word_of_check
    from rbstab.experiment.stored_certificate import certificate_lines
    from rbstab_cli.output.tables import add_row, new_table, number, print_table

    lines = certificate_lines(result)
    if not lines:
        return
    table = new_table("check", "how sure", "what is compared", "found", "at [s]")
    for line in lines:
        when = number(line.when) if not math.isnan(line.when) else "-"
        style = "red" if line.verdict == VIOLATED else None
        row = line.check, word_of_check(line), line.quantity, comparison(line), when
        add_row(table, *row, style=style)
    print_table(table)
