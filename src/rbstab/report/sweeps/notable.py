"""The table of notable members, and the command that reruns one of them."""

import math
from pathlib import Path

import numpy as np

from rbstab.report.model.document import Block, Cell, Head, Table
from rbstab.report.sweeps.borders import notable
from rbstab.report.sweeps.commands import member_command
from rbstab.report.sweeps.conditions.paired_conditions import PairedConditions, paired_conditions_of
from rbstab.report.sweeps.members import FAILED, LEFT_RANGE, OUTCOMES, RETURNS, Members
from rbstab.report.sweeps.parameters import shortened
from rbstab.report.sweeps.quantities import PEAK_LABEL, start_values
from rbstab.report.sweeps.table_entries import number
from rbstab.store.variables import safe_name
from rbstab.sweep.members.outcome import STATUSES

NUMBER_COLUMNS = {
    "settling_time": ("settling time", "s"),
    "smallest_regularity": ("smallest cos θ2", ""),
    "lyapunov_start": ("v(0)", "J"),
}

MAX_COLUMNS = 4
"""Up to this many parameters have a column each; more share one column."""


def notable_blocks(name: str, members: Members, path: Path) -> list[Block]:
    """Return the table of notable members, each with the command that runs it."""
    reasons = notable(members) if members.plan is not None else []
    if not reasons:
        return []
    conditions = paired_conditions_of(members)
    heads = (
        Head("member", numbers=True),
        *([] if conditions is None else [Head("condition")]),
        Head("reason"),
        Head("outcome"),
        *(Head(label, unit, numbers=True) for label, unit in NUMBER_COLUMNS.values()),
        Head(PEAK_LABEL, "m", numbers=True),
        *_parameter_heads(members),
    )
    command = member_command(path)
    rows = tuple(
        (_member(command, k), *_row(members, conditions, reason, k)) for reason, k in reasons
    )
    table = Table(f"{name}-notable", "Notable members", heads, rows)
    sentence = (
        "Any member can be rerun as a single run, which stores its full trajectory. "
        f"For the first member of the table: {command} {reasons[0][1]}"
    )
    return [sentence, table]


def _member(command: str, k: int) -> Cell:
    """Return the number of a member, with the command that runs it."""
    return Cell(str(k), float(k), command=f"{command} {k}")


def _row(
    members: Members, conditions: PairedConditions | None, reason: str, k: int
) -> tuple[Cell, ...]:
    """Return what is said of a member, without its number."""
    peak = float(np.abs(members.column("peak_contact_displacement")[k]).max())
    columns = {name: members.column(name) for name in NUMBER_COLUMNS}
    columns["lyapunov_start"] = start_values(members)
    # Green is only for a member that returns; one that still moves is no alarm.
    tones = {RETURNS: "good", LEFT_RANGE: "bad", FAILED: "bad"}
    tone = tones.get(int(members.outcomes[k]), "")
    return (
        *([] if conditions is None else [Cell(conditions.labels[conditions.codes[k]])]),
        Cell(reason),
        Cell(_outcome(members, k), tone=tone),
        *(number(float(column[k])) for column in columns.values()),
        number(peak),
        *_parameters(members, k),
    )


def _outcome(members: Members, k: int) -> str:
    """Return the outcome of a member: with its tilt, or with how its run failed."""
    word = OUTCOMES[members.outcomes[k]]
    if members.outcomes[k] == FAILED:
        return f"{word}: {STATUSES[members.column('status')[k]]}"
    tilt = math.degrees(members.column("final_tilt")[k])
    return word if members.outcomes[k] == RETURNS else f"{word}, {tilt:.1f}° away"


def _varied(members: Members) -> list[str]:
    """Return the names of the parameter columns."""
    assert members.plan is not None
    return [safe_name(column.key) for column in members.plan.varied_keys]


def _parameter_heads(members: Members) -> list[Head]:
    columns = [members.table.variables[name] for name in _varied(members)]
    if len(columns) > MAX_COLUMNS:
        return [Head("parameters")]
    return [Head(shortened(c.long_name), c.unit, numbers=not c.flags) for c in columns]


def _parameters(members: Members, k: int) -> list[Cell]:
    """Return the parameters of a member: one cell for each, or a single cell if there are many."""
    cells = []
    for name in _varied(members):
        flags, value = members.table.variables[name].flags, members.column(name)[k]
        cells.append(Cell(flags[int(value)]) if flags else number(float(value), 6))
    if len(cells) <= MAX_COLUMNS:
        return cells
    labels = [shortened(members.table.variables[name].long_name) for name in _varied(members)]
    assignments = (f"{label} = {cell.text}" for label, cell in zip(labels, cells, strict=True))
    return [Cell("; ".join(assignments))]
