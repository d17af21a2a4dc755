"""Figures of the energy, dissipation and forces of a run."""

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.report.model.figure import Figure, Line, Panel, Stack
from rbstab.report.model.palette import COLOURS
from rbstab.report.reading.sources import Run
from rbstab.report.runs.figures.curves import FORCES, TIME, axis_of, column_count, components, norms


def energy_figure(run: Run) -> Figure:
    """Return energy and dissipation by part: stacked, and each part on logarithmic axes."""
    energy, dissipation = run.result["energy"], run.result["dissipation"]
    kept = _shown_parts(run)
    labels = tuple(str(run.result["part"][part]) for part in kept)
    panels = [
        panel(run, name, values[:, kept], labels)
        for panel in (_stacked, _separate)
        for name, values in (("energy", energy), ("dissipation", dissipation))
    ]
    return Figure(
        f"{run.name}-energy",
        f"Energy and dissipation by part: {run.label}",
        tuple(panels),
        columns=2,
        caption=f"The energies add up to {'v - ε' if run.stores_v_minus_work else 'v'} plus the "
        "energy at rest, and the dissipations add up to "
        f"{'what is supplied minus ' if run.is_driven else '-'}v'. The lower panels show the "
        "absolute value of each part.",
        shares_time=True,
    )


def force_figures(run: Run) -> tuple[Figure, ...]:
    """Return the contact force, and the force and couple of the stabilizers, by axis.

    If none of them acts, but elements of the config do, there is no such figure.
    """
    # A free body has no contact force.
    acting = [name for name in FORCES if name in run.result and run.result[name].any()]
    if not acting and "element" in run.result:
        return ()
    panels = tuple(components(run, name) for name in acting or FORCES[:1])
    figure = Figure(
        f"{run.name}-forces",
        f"Forces: {run.label}",
        panels,
        columns=column_count(panels),
        shares_time=True,
    )
    return (figure,)


def element_figures(run: Run) -> tuple[Figure, ...]:
    """Return the size of force and couple of each element of the config.

    Each element has the colour that it has in the figure of the energies. If the config has no
    elements, or none of them acts, there is no such figure.
    """
    if "element" not in run.result:
        return ()
    names = [str(name) for name in run.result["element"]]
    numbers = _element_colours(run, names)
    panels = []
    for quantity in ("element_force", "element_couple"):
        values = run.result[quantity]
        marks = [
            Line(
                run.result["time"],
                norms(values[:, number]),
                name,
                colour=numbers[name],
                dash=numbers[name] // len(COLOURS),
            )
            for number, name in enumerate(names)
            if values[:, number].any()
        ]
        if marks:
            panels.append(Panel(TIME, axis_of(quantity), tuple(marks)))
    if not panels:
        return ()
    return (
        Figure(
            f"{run.name}-elements",
            f"Size of the force and the couple of each element: {run.label}",
            tuple(panels),
            columns=2,
            caption="The couple is that about the centre of gravity.",
            shares_time=True,
        ),
    )


def _shown_parts(run: Run) -> list[int]:
    """Return the parts with energy or dissipation; others would only fill the legend."""
    energy, dissipation = run.result["energy"], run.result["dissipation"]
    return [
        part
        for part in range(energy.shape[1])
        if energy[:, part].any() or dissipation[:, part].any()
    ]


def _element_colours(run: Run, names: list[str]) -> dict[str, int]:
    """Return the number of each element's colour; inputs, without energy, follow the parts."""
    parts = [str(run.result["part"][part]) for part in _shown_parts(run)]
    ordered = [*parts, *(name for name in names if name not in parts)]
    return {name: number for number, name in enumerate(ordered)}


def _stacked(run: Run, name: str, parts: Array, labels: tuple[str, ...]) -> Panel:
    t = run.result["time"]
    with np.errstate(all="ignore"):
        total = parts.sum(axis=1)
    marks = (Stack(t, parts, labels), Line(t, total, "sum", cased=True))
    return Panel(TIME, axis_of(name), marks)


def _separate(run: Run, name: str, parts: Array, labels: tuple[str, ...]) -> Panel:
    t = run.result["time"]
    marks = [
        Line(t, np.abs(parts[:, number]), label, colour=number, dash=number // len(COLOURS))
        for number, label in enumerate(labels)
    ]
    return Panel(TIME, axis_of(name, magnitude=True), tuple(marks))
