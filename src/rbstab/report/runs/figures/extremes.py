"""Many runs in one figure: the extremes have colours, and the others are grey."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rbstab.integrate.status import RunStatus
from rbstab.report.model.figure import MUTED
from rbstab.report.model.words import counted, listed
from rbstab.report.reading.sources import Run
from rbstab.report.runs.figures.states import HELD

MOST_COLOURED = 7
"""Up to so many runs have a colour each: the eye does not follow more curves."""

MAX_CURVES = 24
"""Of more runs, only the extremes are drawn."""

MOST_EARLY = 2
"""At most so many of the runs that ended early are coloured, to leave colours for the others."""


def extremes_in_colour(runs: Sequence[Run]) -> tuple[tuple[Run, ...], str]:
    """Return runs in the looks in which figures overlay them, and a sentence that says so.

    Args:
        runs: The runs.

    Returns:
        The runs in their order: up to `MOST_COLOURED` as they are, otherwise the extremes with the
        first colours, and the others grey, with one entry in the legend; of more than `MAX_CURVES`
        the extremes only. The sentence is "" if all have a colour.
    """
    if len(runs) <= MOST_COLOURED:
        return tuple(runs), ""
    chosen: dict[int, list[str]] = {}
    for role, place in _roles(runs):
        chosen.setdefault(place, []).append(role)
    numbers = {place: number for number, place in enumerate(sorted(chosen))}
    others = counted(len(runs) - len(chosen), "other run")
    looks = tuple(
        replace(run, number=numbers[place])
        if place in chosen
        else replace(run, number=MUTED, legend=others)
        for place, run in enumerate(runs)
    )
    named = listed(f"{runs[place].label} ({', '.join(chosen[place])})" for place in sorted(chosen))
    if len(runs) > MAX_CURVES:
        extremes = tuple(run for run in looks if not run.legend)
        return extremes, f"Of {len(runs)} runs, the figures show the extremes: {named}."
    sentence = (
        f"In the figures of all {len(runs)} runs, the extremes have colours: {named}. "
        f"The {others} {'is' if len(runs) - len(chosen) == 1 else 'are'} grey."
    )
    return looks, sentence


def _roles(runs: Sequence[Run]) -> list[tuple[str, int]]:
    """Return what is extreme, each with the place of its run; the first of equal runs."""
    early = [k for k, run in enumerate(runs) if run.result.status != RunStatus.COMPLETED]
    early.sort(key=lambda k: runs[k].summary.end_time)
    roles = [("ended early", k) for k in early[:MOST_EARLY]]
    completed = [k for k in range(len(runs)) if k not in early]
    rest = {k: runs[k].settling_time for k in completed if not math.isnan(runs[k].settling_time)}
    never = [k for k in completed if k not in rest]
    if rest:
        roles.append(("first at rest", min(rest, key=rest.__getitem__)))
    if never:
        roles.append(("not at rest by its end", never[0]))
    elif rest:
        roles.append(("last at rest", max(rest, key=rest.__getitem__)))
    peaks = {k: p for k in completed if np.isfinite(p := runs[k].summary.peak_distance)}
    if max(peaks.values(), default=0.0) > HELD:
        roles.append(("largest peak of |E|", max(peaks, key=peaks.__getitem__)))
    return roles
