"""The small picture on the card of a sweep: how many members are at rest by which time."""

import numpy as np

from rbstab.report.model.document import Sketch
from rbstab.report.model.words import number
from rbstab.report.sweeps.conditions.paired_conditions import PairedConditions
from rbstab.report.sweeps.members import Members
from rbstab.report.sweeps.quantities import settling_time

POINTS = 201
"""Points of each curve."""

MAX_CURVES = 7
"""If there are more conditions, all members are one curve: more colours cannot be told apart."""


def rest_sketch(members: Members, conditions: PairedConditions | None) -> Sketch | None:
    """Return the share of members that are at rest by each time, for each condition.

    The time ends when the last of them came to rest. None if no member did, or all at once at 0 s.
    """
    settled = settling_time(members).values
    end = float(np.max(settled[np.isfinite(settled)], initial=0.0))
    if end <= 0:
        return None
    groups = [("", settled)]
    if conditions is not None and len(conditions.labels) <= MAX_CURVES:
        codes = conditions.codes
        groups = [(label, settled[codes == k]) for k, label in enumerate(conditions.labels)]
    x = np.linspace(0.0, 1.0, POINTS)
    curves = []
    for label, values in groups:
        # NaN, never at rest, is sorted last and counts as later than every time.
        by_then = np.searchsorted(np.sort(values), end * x, side="right")
        curves.append((label, np.column_stack([x, by_then / max(len(values), 1)])))
    caption = "Share of the members that are at rest, over time."
    return Sketch(caption, tuple(curves), None, ("0 s", f"{number(end)} s"), ("0", "1"))
