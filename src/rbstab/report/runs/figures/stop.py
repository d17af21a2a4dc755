"""Figures of a body with a stop: its impacts and its rests."""

import numpy as np

from rbstab.report.model.figure import Axis, Figure, Level, Line, Mark, Panel, Points
from rbstab.report.reading.sources import Run
from rbstab.report.runs.figures.curves import TIME, axis_of
from rbstab.store.result import Result
from rbstab.systems.quantities import BY_NAME


def stop_figures(run: Run) -> list[Figure]:
    """Return the figure of a run with a stop; [] for other runs."""
    if "stop_angle" not in run.result:
        return []
    result = run.result
    panels = [_pitch(result), _loss(result)]
    if "impact_rate" in result:
        panels.insert(1, _rates(result))
    return [
        Figure(
            f"{run.name}-stop",
            f"Impacts against the stop: {run.label}",
            tuple(panels),
            columns=len(panels),
            caption="θ2 meets its stop at the dashed lines. An impact turns its rate back, and "
            "takes energy away. A rest begins where the hops have become too low to be followed, "
            "and ends where the load pulls the body away.",
            shares_time=True,
        )
    ]


def _pitch(result: Result) -> Panel:
    """Return θ2 with its impacts, and where rests begin and end."""
    angle = float(result["stop_angle"])
    marks: list[Mark] = [
        Line(result["time"], result["orientation"][:, 1], "θ2"),
        Level(angle, "stop"),
        Level(-angle),
    ]
    if "impact_time" in result:
        at = np.sign(result["impact_rate"]) * angle
        marks.append(Points(result["impact_time"], at, "impact", colour=1))
    if "rest_begin" in result:
        for name, colour, symbol in (("begin", 2, 2), ("end", 3, 3)):
            times = result[f"rest_{name}"]
            times = times[np.isfinite(times)]
            if not len(times):
                continue
            where = np.searchsorted(result["time"], times).clip(max=len(result["time"]) - 1)
            at = np.sign(result["orientation"][where, 1]) * angle
            marks.append(Points(times, at, f"{name} of a rest", colour=colour, symbol=symbol))
    return Panel(TIME, axis_of("orientation", 1), tuple(marks))


def _rates(result: Result) -> Panel:
    """Return the rates with which θ2 meets its stop."""
    rates = Points(result["impact_time"], np.abs(result["impact_rate"]), "impact", colour=1)
    unit = BY_NAME["impact_rate"].unit
    return Panel(TIME, Axis("rate of θ2 before each impact", unit, log=True), (rates,))


def _loss(result: Result) -> Panel:
    """Return the energy that impacts took away."""
    line = Line(result["time"], result["impact_loss"], "lost in impacts", colour=4, step=True)
    return Panel(TIME, axis_of("impact_loss"), (line,))
