"""Figures of a sliding connector: modes, switches, sticks, releases and chatter."""

from dataclasses import replace

import numpy as np

from rbstab.report.model.figure import Axis, Figure, Level, Line, Mark, Panel, Points
from rbstab.report.reading.sources import Run
from rbstab.report.runs.figures.curves import TIME, axis_of

TRANSITION_STYLES = {"stick": (1, 0), "release": (2, 2)}
"""Colour and symbol of each kind of transition."""


def sliding_figures(run: Run) -> list[Figure]:
    """Return the figures of a run with a sliding connector; [] for other runs."""
    if "mode" not in run.result:
        return []
    limit = Level(float(run.result["trusted_until"]), "trusted until", vertical=True)
    modes, totals = (
        tuple(replace(panel, marks=(*panel.marks, limit)) for panel in panels)
        for panels in ([_mode(run, axis) for axis in range(3)], [_switches(run), _chatter(run)])
    )
    return [
        Figure(
            f"{run.name}-modes",
            f"Modes, sticks and releases: {run.label}",
            modes,
            caption="Modes are shown at the samples. Up to the marked time the trajectory is "
            "reproducible in double precision.",
            shares_time=True,
        ),
        Figure(
            f"{run.name}-switching",
            f"Switches and chatter: {run.label}",
            totals,
            columns=2,
            caption="The chatter energy e is the energy of the bouncing contact point. The "
            "discarded energy is the energy that sticking and implicit steps have removed.",
            shares_time=True,
        ),
    ]


def _mode(run: Run, axis: int) -> Panel:
    """Return the mode of an axis, with the times of its sticks and releases."""
    result = run.result
    mode = result["mode"][:, axis].astype(float)
    marks: list[Mark] = [Line(result["time"], mode, "mode", step=True)]
    if "transition_time" in result:
        on_axis = result["transition_axis"] == axis + 1
        for kind, (colour, symbol) in TRANSITION_STYLES.items():
            times = result["transition_time"][on_axis & (result["transition_kind"] == kind)]
            marks.append(Points(times, np.zeros(len(times)), kind, colour=colour, symbol=symbol))
    return Panel(TIME, replace(axis_of("mode", axis), whole=True), tuple(marks))


def _switches(run: Run) -> Panel:
    t, counts = run.result["time"], run.result["switch_count"]
    marks = [
        Line(t, counts[:, axis].astype(float), label, colour=axis, dash=axis, step=True)
        for axis, label in enumerate(("axis 1", "axis 2", "axis 3"))
    ]
    return Panel(TIME, Axis("switches so far", whole=True), tuple(marks))


def _chatter(run: Run) -> Panel:
    t, result = run.result["time"], run.result
    marks = (
        Line(t, result["chatter_energy"], "chatter energy e", colour=3),
        Line(t, result["discarded_energy"], "discarded energy", colour=4, dash=1),
    )
    return Panel(TIME, Axis("energy", "J", log=True), marks)
