"""The table of members that are worth a look, and the command that runs one of them by itself."""

from pathlib import Path

import numpy as np

from rbstab.report.model.document import Block, Cell, Head, Table
from rbstab.report.model.words import shell_word
from rbstab.report.sweeps.borders import notable
from rbstab.report.sweeps.members import ENDS, Members
from rbstab.report.sweeps.parameters import shortened
from rbstab.report.sweeps.table_entries import number, whole
from rbstab.sweep.folder.layout import safe_name
from rbstab.sweep.folder.sweep_folder import PLAN_FILE
from rbstab.sweep.members.outcome import STATUSES

OUTCOMES = {
    "settling_time": ("settling time", "s"),
    "smallest_regularity": ("smallest cos θ2", ""),
    "lyapunov_start": ("v(0)", "J"),
}

MAX_COLUMNS = 4
"""Parameters that have a column each."""


def replay_command(path: Path, member: int) -> str:
    """The command that runs a member of a sweep as a single run.

    Args:
        path: The file of the sweep; where its plan is not beside it, PLAN.yaml stands for that.
        member: Its number.
    """
    plan = path.parent / PLAN_FILE
    said = shell_word(plan) if plan.is_file() else "PLAN.yaml"
    return f"rbstab run {said} --member {member}"


def notable_blocks(name: str, members: Members, path: Path) -> list[Block]:
    """The members that are worth a look, and how to run them by themselves."""
    found = notable(members) if members.plan is not None else []
    if not found:
        return []
    heads = (
        Head("member", numbers=True),
        Head("why"),
        Head("outcome"),
        *(Head(label, unit, numbers=True) for label, unit in OUTCOMES.values()),
        Head("max |E| by axis", "m", numbers=True),
        *_parameter_heads(members),
        Head("run"),
    )
    rows = tuple(_row(members, why, k) for why, k in found)
    table = Table(f"{name}-notable", "Members worth a look", heads, rows)
    said = (
        "Any member runs again by itself, with its whole motion, as the run that is named; the "
        f"first one of these by: {replay_command(path, found[0][1])}"
    )
    return [said, table]


def _row(members: Members, why: str, k: int) -> tuple[Cell, ...]:
    peak = float(np.abs(members.column("peak_contact_displacement")[k]).max())
    tone = {0: "good", 1: "odd"}.get(int(members.ends[k]), "bad")
    return (
        whole(k),
        Cell(why),
        Cell(_end(members, k), tone=tone),
        *(number(float(members.column(name)[k])) for name in OUTCOMES),
        number(peak),
        *_parameters(members, k),
        Cell(members.column("run_id")[k].decode(errors="replace")[:8]),
    )


def _end(members: Members, k: int) -> str:
    status = str(STATUSES[members.column("status")[k]])
    return status if members.ends[k] > 1 else f"{status}, {ENDS[members.ends[k]]}"


def _varied(members: Members) -> list[str]:
    """The columns of what is varied."""
    assert members.plan is not None
    return [safe_name(column.key) for column in members.plan.columns]


def _parameter_heads(members: Members) -> list[Head]:
    columns = [members.table.layout[name] for name in _varied(members)]
    if len(columns) > MAX_COLUMNS:
        return [Head("parameters")]
    return [Head(shortened(c.long_name), c.unit, numbers=not c.flags) for c in columns]


def _parameters(members: Members, k: int) -> list[Cell]:
    """What is varied, of one member: in a column each, or where these are many in one."""
    cells = []
    for name in _varied(members):
        flags, value = members.table.layout[name].flags, members.column(name)[k]
        cells.append(Cell(flags[int(value)]) if flags else number(float(value), 6))
    if len(cells) <= MAX_COLUMNS:
        return cells
    labels = [shortened(members.table.layout[name].long_name) for name in _varied(members)]
    said = (f"{label} = {cell.text}" for label, cell in zip(labels, cells, strict=True))
    return [Cell("; ".join(said))]
