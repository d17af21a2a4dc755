"""Figures of the Lyapunov function, and of integration errors."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rbstab.report.model.figure import Axis, Figure, Panel
from rbstab.report.reading.sources import Run
from rbstab.report.runs.figures.curves import (
    TIME,
    axis_of,
    curve_of,
    norms,
    overlay,
    runs_with,
    scalar,
)


def decay_figure(runs: Sequence[Run]) -> Figure:
    """Return v, v' and |E| of all runs, each also on a logarithmic axis."""
    value, rate = overlay(runs, "lyapunov"), overlay(runs, "lyapunov_rate")
    distances = [
        curve_of(run, norms(run.result["contact_displacement"]))
        for run in runs_with(runs, "contact_displacement")
    ]
    distance = Panel(TIME, Axis("contact displacement |E|", "m"), tuple(distances))
    panels = (
        value,
        replace(value, y=replace(value.y, log=True)),
        rate,
        _dissipated_power(runs),
        distance,
        replace(distance, y=replace(distance.y, log=True)),
    )
    return Figure(
        "runs-decay",
        "Decay of the Lyapunov function",
        panels,
        columns=2,
        caption=" ".join(
            ["Values at or below zero are not drawn on a logarithmic axis.", *_work_notes(runs)]
        ),
        shares_time=True,
    )


def _work_notes(runs: Sequence[Run]) -> list[str]:
    """Return a sentence that names the runs that store v - ε."""
    names = [run.label for run in runs_with(runs, "lyapunov") if run.stores_v_minus_work]
    return [f"For {', '.join(names)}, v - ε is drawn in place of v."] if names else []


def _dissipated_power(runs: Sequence[Run]) -> Panel:
    """Return -v' on a logarithmic axis."""
    marks = [
        curve_of(run, -run.result["lyapunov_rate"]) for run in runs_with(runs, "lyapunov_rate")
    ]
    axis = axis_of("lyapunov_rate")
    return Panel(TIME, replace(axis, label="dissipated power -v'", log=True), tuple(marks))


def residual_figure(runs: Sequence[Run]) -> Figure:
    """Return |r| of all runs: the difference between v and v(0) + ∫v' dt."""
    marks = [
        curve_of(run, np.abs(run.result["energy_residual"]))
        for run in runs_with(runs, "energy_residual")
    ]
    panel = Panel(TIME, axis_of("energy_residual", magnitude=True), tuple(marks))
    caption = "r = v(t) - v(0) - ∫v' dt is zero apart from integration errors."
    return Figure("runs-residual", "Energy residual", (panel,), caption=caption, shares_time=True)


def audit_figure(run: Run) -> Figure:
    """Return |r| of a run, and the constraint drift in coordinates `manifold`."""
    names = ("energy_residual", "constraint_position_residual", "constraint_velocity_residual")
    panels = tuple(scalar(run, name, magnitude=True) for name in names if name in run.result)
    return Figure(
        f"{run.name}-audit",
        f"Integration errors: {run.label}",
        panels,
        columns=len(panels),
        caption="r = v(t) - v(0) - ∫v' dt. Values that are exactly zero are not drawn.",
        shares_time=True,
    )
