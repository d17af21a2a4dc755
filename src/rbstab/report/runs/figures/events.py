"""The figure of what happens in a run besides its motion: impacts, sliding, loads of elements."""

import numpy as np

from rbstab.report.model.figure import Axis, Figure, Level, Line, Mark, Points
from rbstab.report.reading.sources import Run
from rbstab.report.runs.figures.curves import Curves, axis_of, component_of, parts_of, time_figure
from rbstab.store.result import Result

KINDS = {"stick": (1, 0), "release": (2, 2)}
"""Colour and symbol of each transition of a sliding connector."""


def events_figure(run: Run) -> Figure | None:
    """Return the events of a run, and the loads of its elements; None if there are none."""
    result = run.result
    panels = [
        *(_stop(result) if "stop_angle" in result else ()),
        *(_sliding(result) if "mode" in result else ()),
        *(_elements(run) if "element" in result else ()),
    ]
    if not panels:
        return None
    notes = []
    if "stop_angle" in result:
        notes.append("At the dashed lines θ2 meets its stop.")
    if "mode" in result:
        notes.append(
            "Modes are those at the samples; up to the dashed line the motion is reproducible in "
            "double precision."
        )
    name, title = f"{run.name}-events", "Events and loads of elements"
    return time_figure(name, title, panels, " ".join(notes))


def _stop(result: Result) -> list[Curves]:
    """Return θ2 with impacts and the ends of rests, and the energy that impacts took away."""
    t, angle = result["time"], float(result["stop_angle"])
    pitch = result["orientation"][:, 1]
    marks: list[Mark] = [Line(t, pitch, component_of("orientation", 1))]
    marks += [Level(angle, "stop"), Level(-angle)]
    if "impact_time" in result:
        at = np.sign(result["impact_rate"]) * angle
        marks.append(Points(result["impact_time"], at, "impact", colour=1))
    for name, look in (("begin", 2), ("end", 3)):
        times = result[f"rest_{name}"] if f"rest_{name}" in result else np.zeros(0)
        times = times[np.isfinite(times)]
        at = np.sign(np.interp(times, t, pitch)) * angle
        marks.append(Points(times, at, f"{name} of a rest", colour=look, symbol=look))
    lost = Line(t, result["impact_loss"], "lost in impacts", colour=4, step=True)
    return [
        (axis_of("orientation", 1), marks),
        (axis_of("impact_loss"), [lost]),
    ]


def _sliding(result: Result) -> list[Curves]:
    """Return the mode of each axis with its sticks and releases, and the energy of chatter."""
    t, limit = result["time"], Level(float(result["trusted_until"]), "trusted until", vertical=True)
    panels: list[Curves] = []
    for axis in range(3):
        mode = result["mode"][:, axis].astype(float)
        marks: list[Mark] = [Line(t, mode, "mode", step=True)]
        if "transition_time" in result:
            on_axis = result["transition_axis"] == axis + 1
            for kind, (colour, symbol) in KINDS.items():
                times = result["transition_time"][on_axis & (result["transition_kind"] == kind)]
                marks.append(Points(times, 0.0 * times, kind, colour=colour, symbol=symbol))
        panels.append((Axis(f"mode of axis {axis + 1}", whole=True), [*marks, limit]))
    energies = [
        Line(t, result["chatter_energy"], "chatter energy e", colour=3),
        Line(t, result["discarded_energy"], "discarded energy", colour=4, dash=1),
    ]
    return [*panels, (Axis("energy", "J", log=True), [*energies, limit])]


def _elements(run: Run) -> list[Curves]:
    """Return the sizes of the forces and the couples of elements that act."""
    names = [str(name) for name in run.result["element"]]
    curves = {
        quantity: parts_of(run, names, np.linalg.norm(run.result[quantity], axis=-1))
        for quantity in ("element_force", "element_couple")
    }
    return [(axis_of(quantity), lines) for quantity, lines in curves.items() if lines]
