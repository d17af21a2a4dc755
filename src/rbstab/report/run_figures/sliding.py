"""What a sliding connector does: modes, switches, sticks and releases, chatter."""

from dataclasses import replace

import numpy as np

from rbstab.report.figure import Axis, Figure, Level, Line, Mark, Panel, Points
from rbstab.report.run_figures.curves import COMPONENTS, TIME, axis_of
from rbstab.report.sources import Run

KINDS = {"stick": 0, "release": 2}
"""What happens to an axis, and the symbol of it."""


def sliding_figures(run: Run) -> list[Figure]:
    """The figures of a sliding run; none of another."""
    result = run.result
    if "mode" not in result:
        return []
    t = result["time"]
    modes = [
        Panel(
            TIME,
            axis_of("mode", axis),
            (Line(t, result["mode"][:, axis].astype(float), step=True),),
        )
        for axis in range(3)
    ]
    panels = [*modes, _switches(run), _chatter(run)]
    if "transition_time" in result:
        panels.append(_transitions(run))
    limit = Level(float(result["trusted_until"]), "trusted until", upright=True)
    return [
        Figure(
            f"{run.name}-switching",
            f"Switching: {run.label}",
            tuple(replace(panel, marks=(*panel.marks, limit)) for panel in panels),
            columns=2,
            caption="The modes are those at the samples; beyond the time to which the motion is "
            "reproducible, only slow quantities such as counts and energies mean anything.",
            shares_time=True,
        )
    ]


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


def _transitions(run: Run) -> Panel:
    t, axes = run.result["transition_time"], run.result["transition_axis"]
    kinds = run.result["transition_kind"]
    marks: list[Mark] = []
    for kind, symbol in KINDS.items():
        chosen = np.asarray(kinds == kind)
        marks.append(
            Points(
                t[chosen],
                axes[chosen] - 1.0,
                kind,
                colour=5 if symbol else 6,
                symbol=symbol,
            )
        )
    return Panel(TIME, Axis("sticks and releases", words=COMPONENTS), tuple(marks))
