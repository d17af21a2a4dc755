"""The figure of all rest states along parameters: stable branches, unstable ones, their turns."""

from collections.abc import Iterable, Iterator

import numpy as np

from rbstab.experiment.along.rest_states import AlongStates
from rbstab.report.model.figure import MUTED, Axis, Figure, Line, Mark, Panel, Points

KINDS = ("fold", "pitchfork", "crossing")
"""The turns, in the order of their colours and symbols."""

LEAST = 1e-6
"""rad: an angle that is never larger is not drawn."""


def branch_figure(states_along: Iterable[tuple[Axis, AlongStates]]) -> Figure:
    """Return the angles of all rest states along some parameters, given with their axes."""
    panels = tuple(panel for axis, states in states_along for panel in _panels(axis, states))
    return Figure("rest-states-along", "Rest states along a parameter", panels)


def _panels(axis: Axis, states: AlongStates) -> Iterator[Panel]:
    every = np.concatenate([np.zeros((1, 3)), *(branch.orientations for branch in states.branches)])
    for k in np.flatnonzero(np.abs(every).max(axis=0) > LEAST).tolist() or [0]:
        marks: list[Mark] = []
        for curve in states.branches:
            unstable = curve.index > 0
            # Up to the turns at which it joins an unstable one.
            stable = np.convolve(~unstable, [1, 1, 1], "same") > 0
            for mask, label, colour in ((unstable, "unstable", MUTED), (stable, "stable", 0)):
                if mask.any():
                    y = np.where(mask, curve.orientations[:, k], np.nan)
                    marks.append(Line(curve.values, y, label, colour, dash=int(colour == MUTED)))
        for kind, value, Theta in states.turns:
            number = KINDS.index(kind)
            marks.append(Points(np.array([value]), Theta[[k]], kind, 1 + number, 2 + number))
        yield Panel(axis, Axis(f"θ{k + 1}", "rad"), tuple(marks))
