"""Many runs in one figure: the extremes have colours, and the others are grey."""

import math
from collections.abc import Sequence
from dataclasses import replace

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
    chosen: dict[Run, list[str]] = {}
    for role, run in _roles(runs):
        chosen.setdefault(run, []).append(role)
    extremes = [run for run in runs if run in chosen]
    named = listed(f"{run.label} ({', '.join(chosen[run])})" for run in extremes)
    looks = {run: replace(run, number=number) for number, run in enumerate(extremes)}
    if len(runs) > MAX_CURVES:
        sentence = f"Of {len(runs)} runs, the figures show the extremes: {named}."
        return tuple(looks.values()), sentence
    others = counted(len(runs) - len(extremes), "other run")
    sentence = (
        f"In the figures of all {len(runs)} runs, the extremes have colours: {named}. "
        f"The {others} {'is' if len(runs) - len(extremes) == 1 else 'are'} grey."
    )
    grey = {run: replace(run, number=MUTED, legend=others) for run in runs}
    return tuple((grey | looks).values()), sentence


def _roles(runs: Sequence[Run]) -> list[tuple[str, Run]]:
    """Return what is extreme, each with its run; the first of equal runs."""
    early = [run for run in runs if run.result.status != RunStatus.COMPLETED]
    early.sort(key=lambda run: run.summary.end_time)
    roles = [("ended early", run) for run in early[:MOST_EARLY]]
    completed = [run for run in runs if run not in early]
    at_rest = [run for run in completed if not math.isnan(run.settling_time)]
    never = [run for run in completed if run not in at_rest]
    if at_rest:
        roles.append(("first at rest", min(at_rest, key=lambda run: run.settling_time)))
    if never:
        roles.append(("not at rest by its end", never[0]))
    elif at_rest:
        roles.append(("last at rest", max(at_rest, key=lambda run: run.settling_time)))
    moved = [run for run in completed if HELD < run.summary.peak_distance < math.inf]
    if moved:
        roles.append(("largest peak of |E|", max(moved, key=lambda run: run.summary.peak_distance)))
    return roles
