"""Phase portraits of the rotation."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rbstab.report.model.figure import MUTED, Figure, Line, Mark, Panel, Points
from rbstab.report.reading.sources import Run
from rbstab.report.runs.figures.between_samples import Path, path_between_samples
from rbstab.report.runs.figures.curves import axis_of, curve_of, runs_with

MARGIN = 0.04
"""Space between the curves and the edges of a panel, as a share of its length."""

LARGEST = 1e150
"""Larger values have no room on an axis."""

NAMES = ("orientation", "angular_velocity")


def phase_figure(run: Run) -> Figure:
    """Return the phase portraits of a run, with its start, its end and its rest state."""
    return _figure([run], f"{run.name}-phase", f"Phase portraits: {run.label}", single=True)


def overlaid_phases(runs: Sequence[Run]) -> Figure:
    """Return the phase portraits of several runs, overlaid, with their starts and rest states."""
    return _figure(runs_with(runs, *NAMES), "runs-phase", "Phase portraits", single=False)


def _figure(runs: Sequence[Run], name: str, title: str, *, single: bool) -> Figure:
    paths = [path_between_samples(run) for run in runs]
    panels = []
    for component in range(3):
        marks: list[Mark] = []
        for run, path in zip(runs, paths, strict=True):
            curve = curve_of(
                run, path.angular_velocity[:, component], path.orientation[:, component]
            )
            marks.append(Line(curve.x, curve.y) if single else curve)
        marks += _marked(runs, component, single=single)
        x, y = (
            replace(axis_of(quantity, component), ends=_ends(marks, letter))
            for quantity, letter in zip(NAMES, "xy", strict=True)
        )
        panels.append(Panel(x, y, tuple(marks)))
    return Figure(name, title, tuple(panels), columns=3, caption=_caption(runs, paths))


def _marked(runs: Sequence[Run], component: int, *, single: bool) -> list[Mark]:
    """Return the starts of runs and their rest states; of a single run also its end."""
    x, y = (np.array([run.result[name][:, component][[0, -1]] for run in runs]) for name in NAMES)
    if single:
        marks: list[Mark] = [
            Points(x[:, 0], y[:, 0], "start", colour=1, symbol=2),
            Points(x[:, 1], y[:, 1], "end", colour=1, symbol=0),
        ]
    else:
        marks = [
            Points(x[[k], 0], y[[k], 0], "start", colour=run.number, symbol=2, key=MUTED)
            for k, run in enumerate(runs)
        ]
    owners: dict[float, list[Run]] = {}
    for run in _with_rest(runs):
        place = round(float(run.result["rest_orientation"][component]), 9)
        owners.setdefault(place, []).append(run)
    zero = np.zeros(1)
    for place, own in owners.items():
        # A rest state that several runs have in common needs one mark only, of no run's colour.
        tint = own[0].number if len(own) == 1 and not single else MUTED
        at = np.array([place])
        marks.append(Points(at, zero, "rest state", colour=tint, symbol=1, key=MUTED))
    return marks


def _ends(marks: Sequence[Mark], letter: str) -> tuple[float, float] | None:
    """Return the ends of an axis with a margin around its marks; None if they need none."""
    values = np.concatenate(
        [getattr(mark, letter) for mark in marks if isinstance(mark, Line | Points)]
    )
    shown = values[np.abs(values) < LARGEST]
    if not len(shown) or not np.ptp(shown) > 0:
        return None
    room = MARGIN * float(np.ptp(shown))
    return float(shown.min()) - room, float(shown.max()) + room


def _with_rest(runs: Sequence[Run]) -> list[Run]:
    """Return the runs whose file has the rest state at which v is zero."""
    return [
        run
        for run in runs_with(runs, "rest_orientation")
        if np.isfinite(run.result["rest_orientation"]).all()
    ]


def _caption(runs: Sequence[Run], paths: Sequence[Path]) -> str:
    """Return how the curves are interpolated, and which rest state is marked."""
    sentences = []
    cubics, intervals = (sum(getattr(p, name) for p in paths) for name in ("cubics", "intervals"))
    if cubics:
        sentences.append(
            "Between samples, a cubic through both states and both rates is drawn, where it obeys "
            f"the equations of motion: in {cubics} of {intervals} intervals."
        )
    if cubics < intervals:
        others = "The other samples" if cubics else "Samples"
        sentences.append(f"{others} are joined by straight lines.")
    if _with_rest(runs):
        sentences.append("The rest state is the one at which v is zero; there Ω = 0.")
    return " ".join(sentences)
