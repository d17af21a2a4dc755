"""Figures of the Lyapunov function, and of integration errors."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rbstab.experiment.summary import lyapunov_function_of
from rbstab.mechanics.numbers import Array
from rbstab.report.model.figure import Axis, Figure, Line, Panel
from rbstab.report.reading.sources import Run
from rbstab.report.runs.figures.curves import (
    TIME,
    WORK_NOTE,
    axis_of,
    balanced,
    curve_of,
    norms,
    overlay,
    runs_with,
    scalar,
)


def decay_figure(runs: Sequence[Run]) -> Figure:
    """Return v, v' and |E| of all runs, each also on a logarithmic axis."""
    stored = [run for run in runs_with(runs, "lyapunov") if run.stores_v_minus_work]
    v = tuple(
        curve_of(run, lyapunov_function_of(run.result)) for run in runs_with(runs, "lyapunov")
    )
    value, rate = Panel(TIME, axis_of("lyapunov"), v), overlay(runs, "lyapunov_rate")
    distances = [
        curve_of(run, norms(run.result["contact_displacement"]))
        for run in runs_with(runs, "contact_displacement")
    ]
    distance = Panel(TIME, Axis("contact displacement |E|", "m"), tuple(distances))
    panels = (
        replace(value, marks=(*v, *map(balanced, stored))),
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
        caption="Values at or below zero are not drawn on a logarithmic axis."
        + (f" {WORK_NOTE}" if stored else ""),
        shares_time=True,
    )


def _dissipated_power(runs: Sequence[Run]) -> Panel:
    """Return the dissipated power on a logarithmic axis: -v', but where inputs supply power."""
    shown = runs_with(runs, "lyapunov_rate")
    marks = [
        curve_of(
            run,
            _sum_of_parts(run, "dissipation") if run.is_driven else -run.result["lyapunov_rate"],
        )
        for run in shown
    ]
    label = "dissipated power" if any(run.is_driven for run in shown) else "dissipated power -v'"
    axis = axis_of("lyapunov_rate")
    return Panel(TIME, replace(axis, label=label, log=True), tuple(marks))


def supply_figures(run: Run) -> tuple[Figure, ...]:
    """Return v with what was supplied and dissipated, and the powers; () without inputs."""
    if not run.is_driven:
        return ()
    t, result = run.result["time"], run.result
    supplied = result["supplied_energy"]
    dissipated = supplied - result["lyapunov_change"]
    energies = (
        Line(t, result["lyapunov"], "v", colour=0),
        Line(t, supplied, "supplied since the start", colour=1, dash=1),
        Line(t, dissipated, "dissipated since the start", colour=2, dash=2),
    )
    names = [str(part) for part in result["part"]]
    powers = [
        Line(
            t,
            result["supplied_power"][:, number],
            f"supplied by {names[number]}",
            colour=colour + 3,
        )
        for colour, number in enumerate(np.flatnonzero(result["supplied_power"].any(axis=0)))
    ]
    lost = Line(t, _sum_of_parts(run, "dissipation"), "dissipated", colour=2, dash=2)
    return (
        Figure(
            f"{run.name}-supply",
            f"What inputs supply: {run.label}",
            (
                Panel(TIME, Axis("energy", "J"), energies),
                Panel(TIME, Axis("power", "W"), (*powers, lost)),
            ),
            columns=2,
            caption="v = v(0) + supplied - dissipated. v can rise only while more is supplied than "
            "dissipated. Both are integrated together with the motion.",
            shares_time=True,
        ),
    )


def _sum_of_parts(run: Run, name: str) -> Array:
    with np.errstate(all="ignore"):
        return np.asarray(run.result[name].sum(axis=1))


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
