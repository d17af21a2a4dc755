"""What `rbstab guard` prints: the run of the given config beside that with the guard."""

import math
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rbstab.experiment.tuning.guard import RunOutcome

_ROWS = (
    ("status", "status"),
    ("largest |θ2| [rad]", "largest_pitch"),
    ("v below v(0)/1000 from [s]", "settling_time"),
    ("largest couple of the guard [N m]", "largest_couple"),
)


PEAKS = ("largest_pitch", "largest_couple")
"""The fields of `RunOutcome` that follow from the largest |θ2|."""


def print_runs(
    strength: tuple[str, float | None],
    given: "RunOutcome",
    guarded: "RunOutcome | None",
    facts: tuple[tuple[str, str], ...] = (),
) -> None:
    """Print both runs as a table.

    Args:
        strength: The label and the value of the strength of the guard; None: none was found.
        given: The run of the given config.
        guarded: The run with the guard; None without one.
        facts: Further rows on the guard: label and text.
    """
    from rbstab_cli.output.tables import add_row, new_table, number, print_table

    table = new_table("quantity", "given", "guarded", numbers=("given", "guarded"))
    label, value = strength
    add_row(table, label, "-", "none was found" if value is None else number(value))
    outcomes = [given] if guarded is None else [given, guarded]
    for name, field in _ROWS:
        shown = [_shown(outcome, field) for outcome in outcomes]
        add_row(table, name, *shown, *["-"] * (2 - len(shown)))
    for name, text in facts:
        add_row(table, name, "-", text)
    print_table(table)


def _shown(outcome: "RunOutcome", field: str) -> str:
    from rbstab.experiment.summary import at_least
    from rbstab_cli.output.tables import number

    value: Any = getattr(outcome, field)
    if field == "status":
        return str(value)
    if field in PEAKS:
        # A guard without a couple in this run has none between the samples either, as far as known.
        return f"{at_least(outcome.pitch_resolved or value == 0)}{number(value)}"
    return "not in this run" if math.isnan(value) else number(value)
