"""Figures of the Lyapunov function: how it decays, and its parts."""

from collections.abc import Sequence

import numpy as np

from rbstab.experiment.summary import lyapunov_function_of
from rbstab.mechanics.numbers import Array
from rbstab.report.model.figure import Axis, Figure, Line, Stack
from rbstab.report.reading.sources import Run
from rbstab.report.runs.figures.curves import (
    Curves,
    acting_parts,
    axis_of,
    curve_of,
    parts_of,
    time_figure,
)


def decay_figure(runs: Sequence[Run]) -> Figure:
    """Return v and the dissipated power, logarithmic; of a driven run the balance of its energy."""
    if len(runs) == 1 and runs[0].is_driven:
        return _supply_figure(runs[0])
    v = [curve_of(run, lyapunov_function_of(run.result)) for run in runs]
    lost = [curve_of(run, _dissipated(run)) for run in runs]
    panels = (axis_of("lyapunov", log=True), v), (Axis("dissipated power", "W", log=True), lost)
    caption = "The dissipated power is -v'."
    if any(run.is_driven for run in runs):
        caption = "Where elements supply power, v may rise."
    elif any(run.stores_v_minus_work for run in runs):
        caption = (
            "The dissipated power is -v', and on a surface s = F + κE it is -(v - ε)', where ε is "
            "the work of the contact force."
        )
    if any("impact_loss" in run.result for run in runs):
        caption += " At an impact v falls at once."
    return time_figure("runs-decay", "Decay of the Lyapunov function", panels, caption)


def _supply_figure(run: Run) -> Figure:
    """Return v with what was supplied and dissipated since the start, and the powers."""
    t, supplied = run.result["time"], run.result["supplied_energy"]
    energies = [
        Line(t, run.result["lyapunov"], "v", colour=0),
        Line(t, supplied, "supplied since the start", colour=1, dash=1),
        Line(t, supplied - run.result["lyapunov_change"], "dissipated since the start", 2, 2),
    ]
    powers = run.result["supplied_power"]
    curves = [
        Line(t, powers[:, number], f"supplied by {run.result['part'][number]}", colour + 3)
        for colour, number in enumerate(np.flatnonzero(powers.any(axis=0)).tolist())
    ]
    curves.append(Line(t, _dissipated(run), "dissipated", colour=2, dash=2))
    return time_figure(
        "runs-decay",
        "What elements supply, and what is dissipated",
        ((Axis("energy", "J"), energies), (Axis("power", "W"), curves)),
        "v = v(0) + supplied - dissipated: v rises only while more is supplied than dissipated.",
    )


def energy_figure(run: Run) -> Figure:
    """Return energy and dissipation by part: stacked, and each part on logarithmic axes."""
    labels = acting_parts(run)
    acting = np.isin(run.result["part"].astype(str), labels)
    t = run.result["time"]
    stacks: list[Curves] = []
    parts: list[Curves] = []
    for name in ("energy", "dissipation"):
        values = run.result[name][:, acting]
        total = Line(t, values.sum(axis=1), "sum", cased=True)
        stacks.append((axis_of(name), [Stack(t, values, tuple(labels)), total]))
        sizes = parts_of(run, labels, np.abs(values))
        parts.append((axis_of(name, size=True, log=True), sizes))
    v = "v - ε" if run.stores_v_minus_work else "v"
    rate = "what is supplied minus v'" if run.is_driven else "-v'"
    caption = f"The energies add up to {v} plus the energy at rest, the dissipations to {rate}."
    title = "Energy and dissipation by part"
    return time_figure(f"{run.name}-energy", title, (*stacks, *parts), caption)


def _dissipated(run: Run) -> Array:
    power: Array = run.result["dissipation"].sum(axis=1)
    return power
