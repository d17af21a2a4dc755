"""Figures of the states over time: the rotation, and the contact point or what holds it."""

from collections.abc import Sequence

import numpy as np

from rbstab.report.model.figure import MUTED, Figure, Panel, Points
from rbstab.report.reading.sources import Run
from rbstab.report.runs.figures.curves import axis_of, components, curve_of, time_figure

ROTATION = ("orientation", "angular_velocity")

FORCES = ("contact_force", "stabilizing_force")
"""What acts on the contact point; the first that acts is drawn. A free body has no such force."""

HELD = 1e-9
"""m: a contact point that moves less is held, and its displacement is round-off."""


def rotation_figure(runs: Sequence[Run]) -> Figure:
    """Return Θ and Ω over time: all components of one run, or a row for each of several runs."""
    if len(runs) == 1:
        panels = [components(runs[0], name) for name in ROTATION]
    else:
        panels = [
            (axis_of(name, k), [curve_of(run, run.result[name][:, k]) for run in runs])
            for k in range(3)
            for name in ROTATION
        ]
    return time_figure("runs-rotation", "Rotation", panels)


def contact_figure(runs: Sequence[Run]) -> Figure | None:
    """Return E and the force on the contact point; None if nothing moves and nothing acts.

    A held contact point has no E. Of several runs, the sizes are drawn, of forces logarithmic.
    """
    E = [np.linalg.norm(run.result["contact_displacement"], axis=-1) for run in runs]
    moving = ["contact_displacement"] if max(map(np.max, E)) > HELD else []
    acting = [name for name in FORCES if any(run.result[name].any() for run in runs)]
    names = [*moving, *acting[:1]]
    if len(runs) == 1:
        panels = [components(runs[0], name) for name in names]
    else:
        panels = [
            (
                axis_of(name, size=True, log=name in FORCES),
                [curve_of(run, np.linalg.norm(run.result[name], axis=-1)) for run in runs],
            )
            for name in names
        ]
    return time_figure("runs-contact", "Contact point", panels) if panels else None


def phase_figure(runs: Sequence[Run]) -> Figure:
    """Return the phase plane of each angle, with starts and the rest states at which v is zero."""
    panels = []
    for component in range(3):
        x, y = (axis_of(name, component) for name in ROTATION)
        curves, starts, rests = [], [], []
        for run in runs:
            angle, rate = (run.result[name][:, component] for name in ROTATION)
            curves.append(curve_of(run, rate, angle))
            starts.append(Points(angle[:1], rate[:1], "start", run.number, symbol=2, key=MUTED))
            at = run.result["rest_orientation"][[component]]
            rests.append(Points(at, 0.0 * at, "rest state", run.number, symbol=1, key=MUTED))
        panels.append(Panel(x, y, (*curves, *starts, *rests)))
    caption = "Samples are joined by straight lines. At the rest state v is zero."
    return Figure("runs-phase", "Phase planes", tuple(panels), columns=3, caption=caption)
