"""Figures of the Lyapunov function: how it decays, and its parts."""

from collections.abc import Sequence

import numpy as np

from rbstab.experiment.summary import lyapunov_function_of
from rbstab.mechanics.numbers import Array
from rbstab.report.model.figure import Axis, Figure, Line, Panel, Stack
from rbstab.report.reading.sources import Run
from rbstab.report.runs.figures.curves import (
    TIME,
    acting_parts,
    axis_of,
    curve_of,
    parts_of,
)

ENERGIES = ("energy", "dissipation")


def decay_figure(runs: Sequence[Run]) -> Figure:
    """Return v and the dissipated power, logarithmic; of a driven run the balance of its energy."""
    if len(runs) == 1 and runs[0].is_driven:
        return _supply_figure(runs[0])
    v = tuple(curve_of(run, lyapunov_function_of(run.result)) for run in runs)
    lost = tuple(curve_of(run, _sum_of_parts(run, "dissipation")) for run in runs)
    panels = (
        Panel(TIME, axis_of("lyapunov", log=True), v),
        Panel(TIME, Axis("dissipated power", "W", log=True), lost),
    )
    caption = "The dissipated power is -v'."
    if any(run.is_driven for run in runs):
        caption = "Where inputs supply power, v may rise."
    elif any(run.stores_v_minus_work for run in runs):
        caption = (
            "The dissipated power is -v', and on a surface s = F + κE it is -(v - ε)', where ε is "
            "the work of the contact force."
        )
    if any("impact_loss" in run.result for run in runs):
        caption += " At an impact v falls at once."
    title = "Decay of the Lyapunov function"
    return Figure("runs-decay", title, panels, 2, caption=caption, shares_time=True)


def _supply_figure(run: Run) -> Figure:
    """Return v with what was supplied and dissipated since the start, and the powers."""
    t, supplied = run.result["time"], run.result["supplied_energy"]
    energies = (
        Line(t, run.result["lyapunov"], "v", colour=0),
        Line(t, supplied, "supplied since the start", colour=1, dash=1),
        Line(t, supplied - run.result["lyapunov_change"], "dissipated since the start", 2, 2),
    )
    powers = run.result["supplied_power"]
    curves = [
        Line(t, powers[:, number], f"supplied by {run.result['part'][number]}", colour + 3)
        for colour, number in enumerate(np.flatnonzero(powers.any(axis=0)).tolist())
    ]
    lost = Line(t, _sum_of_parts(run, "dissipation"), "dissipated", colour=2, dash=2)
    return Figure(
        "runs-decay",
        "What inputs supply, and what is dissipated",
        (
            Panel(TIME, Axis("energy", "J"), energies),
            Panel(TIME, Axis("power", "W"), (*curves, lost)),
        ),
        columns=2,
        caption="v = v(0) + supplied - dissipated: v rises only while more is supplied than "
        "dissipated.",
        shares_time=True,
    )


def energy_figure(run: Run) -> Figure:
    """Return energy and dissipation by part: stacked, and each part on logarithmic axes."""
    stacks, parts = [], []
    labels = tuple(acting_parts(run))
    acting = np.isin(run.result["part"].astype(str), labels)
    t = run.result["time"]
    for name in ENERGIES:
        values = run.result[name][:, acting]
        with np.errstate(all="ignore"):
            total = Line(t, values.sum(axis=1), "sum", cased=True)
        stacks.append(Panel(TIME, axis_of(name), (Stack(t, values, labels), total)))
        sizes = tuple(parts_of(run, labels, np.abs(values)))
        parts.append(Panel(TIME, axis_of(name, size=True, log=True), sizes))
    v, rate = ("v - ε" if run.stores_v_minus_work else "v"), "-v'"
    if run.is_driven:
        rate = "what is supplied minus v'"
    return Figure(
        f"{run.name}-energy",
        "Energy and dissipation by part",
        (*stacks, *parts),
        columns=2,
        caption=f"The energies add up to {v} plus the energy at rest, the dissipations to {rate}.",
        shares_time=True,
    )


def _sum_of_parts(run: Run, name: str) -> Array:
    with np.errstate(all="ignore"):
        return np.asarray(run.result[name].sum(axis=1))
