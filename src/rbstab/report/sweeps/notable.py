"""Notable members, each with the command that runs it: extremes and failures."""

import math

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.report.model.document import Block, Cell, Entry, Head, Table
from rbstab.report.sweeps.members import FAILED, LEFT_RANGE, OUTCOMES, RETURNS, Members
from rbstab.report.sweeps.parameters import shortened
from rbstab.report.sweeps.quantities import (
    peak_displacement,
    regularity,
    settling_time,
    start_energy,
    start_over_level,
)
from rbstab.store.variables import safe_name
from rbstab.sweep.members.outcome import STATUSES

MAX_PER_REASON = 2
"""Maximum number of members in the list for each reason."""

TONES = {RETURNS: "good", LEFT_RANGE: "bad", FAILED: "bad"}
"""Green is only for a member that returns; one that still moves is no alarm."""


def notable_blocks(name: str, members: Members, command: str) -> list[Block]:
    """Return the table of notable members, each with the command that runs it.

    Args:
        name: The name of the sweep; that of the table begins with it.
        members: The members.
        command: The command that runs a member, without its number.
    """
    reasons = notable(members) if members.plan is not None else {}
    if not reasons:
        return []
    quantities = [quantity_of(members) for quantity_of in (settling_time, regularity, start_energy)]
    quantities.append(peak_displacement(members))
    measured = (Head(q.axis.label, q.axis.unit) for q in quantities)
    heads: list[str | Head] = ["member", "reason", "outcome", *measured, "parameters"]
    rows: list[tuple[Entry, ...]] = [
        (
            Cell(str(k), float(k), command=f"{command} {k}"),
            reason,
            _outcome(members, k),
            *(float(q.values[k]) for q in quantities),
            _parameters(members, k),
        )
        for k, reason in reasons.items()
    ]
    table = Table.of(f"{name}-notable", "Notable members", heads, rows, "")
    sentence = f"A single run of a member has its whole motion: {command} {next(iter(reasons))}"
    return [sentence, table]


def notable(members: Members) -> dict[int, str]:
    """Return the reason by the number of each notable member: the first reason, if it has more."""
    over_level, failed = start_over_level(members), members.outcomes == FAILED
    nearest = [] if over_level is None else _smallest(np.abs(over_level.values - 1))
    cosines = _smallest(np.where(members.completed, regularity(members).values, np.nan))
    last = _smallest(np.where(members.at_rest, -settling_time(members).values, np.nan))[:1]
    return (
        dict.fromkeys(np.flatnonzero(failed)[:MAX_PER_REASON].tolist(), OUTCOMES[FAILED])
        | dict.fromkeys(last, "comes to rest last")
        | dict.fromkeys(nearest, "v(0) nearest c*")
        | dict.fromkeys(cosines, "smallest cos θ2 of completed members")
    )


def _smallest(values: Array) -> list[int]:
    """Return the numbers of the members with the smallest finite values."""
    order = np.argsort(values, kind="stable")[:MAX_PER_REASON]
    return order[np.isfinite(values[order])].tolist()


def _outcome(members: Members, k: int) -> Cell:
    """Return the outcome of a member: with its tilt, or with how its run failed."""
    code = int(members.outcomes[k])
    text = OUTCOMES[code]
    if code == FAILED:
        text += f": {STATUSES[members.column('status')[k]]}"
    elif code != RETURNS:
        text += f", {math.degrees(members.column('final_tilt')[k]):.1f}° away"
    return Cell(text, tone=TONES.get(code, ""))


def _parameters(members: Members, k: int) -> str:
    """Return the varied values of a member."""
    assert members.plan is not None
    texts = []
    for key in members.plan.varied_keys:
        variable = members.table.variables[safe_name(key.key)]
        value = members.column(safe_name(key.key))[k]
        text = variable.flags[int(value)] if variable.flags else f"{float(value):.6g}"
        texts.append(f"{shortened(variable.long_name)} = {text}")
    return "; ".join(texts)
