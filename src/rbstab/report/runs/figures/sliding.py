"""What a sliding connector does: modes, switches, sticks and releases, chatter."""

from dataclasses import replace

import numpy as np

from rbstab.report.model.figure import Axis, Figure, Level, Line, Mark, Panel, Points
from rbstab.report.reading.sources import Run
from rbstab.report.runs.figures.curves import COMPONENTS, TIME, axis_of

KINDS = {"stick": (1, 0), "release": (2, 2)}
"""What happens to an axis, and the colour and the symbol of it."""


def sliding_figures(run: Run) -> list[Figure]:
    """The figures of a sliding run; none of another."""
    if "mode" not in run.result:
        return []
    limit = Level(float(run.result["trusted_until"]), "trusted until", upright=True)
    modes, totals = (
        tuple(replace(panel, marks=(*panel.marks, limit)) for panel in panels)
        for panels in ([_mode(run, axis) for axis in range(3)], [_switches(run), _chatter(run)])
    )
    return [
        Figure(
            f"{run.name}-modes",
            f"Modes, sticks and releases: {run.label}",
            modes,
            caption="The modes are those at the samples. Up to the time that is marked the motion "
            "is reproducible in double precision.",
            shares_time=True,
        ),
        Figure(
            f"{run.name}-switching",
            f"Switches and chatter: {run.label}",
            totals,
            columns=2,
            caption="e is what the bouncing holds; what is discarded is taken away by sticking, or "
            "by implicit steps.",
            shares_time=True,
        ),
    ]


def _mode(run: Run, axis: int) -> Panel:
    """The mode of an axis, and when it sticks and is released."""
    result = run.result
    mode = result["mode"][:, axis].astype(float)
    marks: list[Mark] = [Line(result["time"], mode, "mode", step=True)]
    if "transition_time" in result:
        here = result["transition_axis"] == axis + 1
        for kind, (colour, symbol) in KINDS.items():
            times = result["transition_time"][here & (result["transition_kind"] == kind)]
            marks.append(Points(times, np.zeros(len(times)), kind, colour=colour, symbol=symbol))
    return Panel(TIME, axis_of("mode", axis), tuple(marks))


def _switches(run: Run) -> Panel:
    t, counts = run.result["time"], run.result["switch_count"]
    marks = [
        Line(t, counts[:, axis].astype(float), label, colour=axis, dash=axis, step=True)
        for axis, label in enumerate(COMPONENTS)
    ]
    return Panel(TIME, Axis("switches so far"), tuple(marks))


def _chatter(run: Run) -> Panel:
    t, result = run.result["time"], run.result
    marks = (
        Line(t, result["chatter_energy"], "chatter energy e", colour=3),
        Line(t, result["discarded_energy"], "discarded energy", colour=4, dash=1),
    )
    return Panel(TIME, Axis("energy", "J", log=True), marks)
