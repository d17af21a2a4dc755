"""The Lyapunov function of runs, and how well it balances."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rbstab.report.model.figure import Axis, Figure, Panel
from rbstab.report.reading.sources import Run
from rbstab.report.runs.figures.curves import (
    TIME,
    axis_of,
    curve_of,
    having,
    overlay,
    scalar,
    sizes,
)


def decay_figure(runs: Sequence[Run]) -> Figure:
    """v, v' and |E| of all runs, and beside them their sizes on logarithmic axes."""
    value, rate = overlay(runs, "lyapunov"), overlay(runs, "lyapunov_rate")
    distances = [
        curve_of(run, sizes(run.result["contact_displacement"]))
        for run in having(runs, "contact_displacement")
    ]
    distance = Panel(TIME, Axis("contact displacement |E|", "m"), tuple(distances))
    panels = (
        value,
        replace(value, y=replace(value.y, log=True)),
        rate,
        _falling(runs),
        distance,
        replace(distance, y=replace(distance.y, log=True)),
    )
    return Figure(
        "runs-decay",
        "Decay of the Lyapunov function",
        panels,
        columns=2,
        caption=" ".join(["What is zero or below is not drawn on a logarithmic axis.", *_of(runs)]),
        shares_time=True,
    )


def _of(runs: Sequence[Run]) -> list[str]:
    """What has to be said of runs whose v is none."""
    names = [run.label for run in having(runs, "lyapunov") if run.counts_work]
    return [f"Of {', '.join(names)} v - ε is drawn in place of v."] if names else []


def _falling(runs: Sequence[Run]) -> Panel:
    """How fast v falls, -v', on a logarithmic axis."""
    marks = [curve_of(run, -run.result["lyapunov_rate"]) for run in having(runs, "lyapunov_rate")]
    axis = axis_of("lyapunov_rate")
    return Panel(TIME, replace(axis, label="dissipated power -v'", log=True), tuple(marks))


def residual_figure(runs: Sequence[Run]) -> Figure:
    """|r| of all runs: how far v is from v(0) + ∫v' dt."""
    marks = [
        curve_of(run, np.abs(run.result["energy_residual"]))
        for run in having(runs, "energy_residual")
    ]
    panel = Panel(TIME, axis_of("energy_residual", size=True), tuple(marks))
    caption = "r = v(t) - v(0) - ∫v' dt is zero but for the errors of the integration."
    return Figure("runs-residual", "Energy residual", (panel,), caption=caption, shares_time=True)


def audit_figure(run: Run) -> Figure:
    """|r| of a run, and how far a point that is held on the sub manifold has drifted."""
    names = ("energy_residual", "constraint_position_residual", "constraint_velocity_residual")
    panels = tuple(scalar(run, name, size=True) for name in names if name in run.result)
    return Figure(
        f"{run.name}-audit",
        f"Errors of the integration: {run.label}",
        panels,
        columns=len(panels),
        caption="r = v(t) - v(0) - ∫v' dt; what is exactly zero is not drawn.",
        shares_time=True,
    )
