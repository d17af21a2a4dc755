"""The certificate of a run, as data and as a table."""

import math
from typing import Any

from rbstab.experiment.answers.check_words import comparison, word_of_check
from rbstab.experiment.stored_certificate import certificate_lines
from rbstab.store.result import Result
from rbstab_cli.printing import Table, number

VIOLATED = "violated"


def certificate_checks(result: Result) -> list[dict[str, Any]]:
    """Return the checks of the certificate; none if the result has no certificate.

    `word` says how sure each is, as in the table.
    """
    return [{**line._asdict(), "word": word_of_check(line)} for line in certificate_lines(result)]


def print_certificate(result: Result) -> None:
    """Print the checks as a table."""
    lines = certificate_lines(result)
    table = Table("check", "how sure", "what is compared", "found", "at [s]")
    for line in lines:
        when = number(line.when) if not math.isnan(line.when) else "-"
        style = "red" if line.verdict == VIOLATED else None
        found = (word_of_check(line), line.quantity, comparison(line), when)
        table.add(line.check, *found, style=style)
    if lines:
        table.print()
