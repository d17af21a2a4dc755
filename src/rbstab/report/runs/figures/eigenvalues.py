"""The figure of the eigenvalues at the rest states of runs."""

from collections.abc import Sequence

import numpy as np

from rbstab.analysis.linearisation import are_real
from rbstab.config.errors import ConfigError
from rbstab.config.user_code.permission import has_code
from rbstab.experiment.along.locus import LocusPoint, linearised_at_rest
from rbstab.experiment.answers.wanted import in_degrees
from rbstab.report.model.figure import Axis, Figure, Level, Panel, Points
from rbstab.report.model.words import counted
from rbstab.report.reading.sources import Run
from rbstab.report.runs.figures.curves import has_guard

REAL, IMAGINARY = Axis("real part Re λ", "1/s"), Axis("imaginary part Im λ", "1/s")

SYMBOLS = 6
"""The symbols of runs, from 1 on: all are open, so that equal eigenvalues of two runs are seen.
There is one less than colours, so that runs with the same symbol have other colours."""

SLOW_FACTOR = 10.0
"""Eigenvalues that decay more times as fast as the slowest of a run decide nothing: not drawn."""

BORDER = Level(0.0, "border of stability", vertical=True)


def eigenvalue_figure(runs: Sequence[Run]) -> Figure | None:
    """Return the slow eigenvalues of the motions linearised at rest; None if none is known."""
    marks: list[Points] = []
    notes = ["Linearised at the rest state Θ in the legend."]
    fast = 0
    for run in runs:
        point = _point(run)
        if point is None or point.linearisation is None or point.orientation is None:
            continue
        values = point.linearisation.eigenvalues
        # A stop may hold θ2 at rest: its eigenvalues, then zero, say nothing on stability.
        if has_guard(run, "stop") and (values == 0).any():
            values = values[values != 0]
            notes.append("θ2, held by a stop, has none.")
        slowest = -float(values.real.max())
        slow = values[-values.real <= (SLOW_FACTOR * slowest if slowest > 0 else np.inf)]
        fast += len(values) - len(slow)
        marks.append(
            Points(
                slow.real,
                np.where(are_real(slow), 0.0, slow.imag),
                f"{run.label}, at {in_degrees(point.orientation)}",
                colour=run.number,
                symbol=1 + run.number % SYMBOLS,
                texts=tuple(map(_described, slow.tolist())),
                group=run.legend,
            )
        )
        # On s = F + κE the body is linearised as held at E = 0.
        surface = getattr(run.config and run.config.controller, "surface", None)
        if getattr(surface, "slope", None) is not None:
            notes.append("Not drawn: the modes exp(-κt) of a sliding surface.")
    if not marks:
        return None
    if fast:
        factor = f"{SLOW_FACTOR:g}"
        notes.append(f"Not drawn: {fast} that decay over {factor} times as fast as the slowest.")
    if len(marks) < len(runs):
        notes.append(f"Not known of {counted(len(runs) - len(marks), 'run')}.")
    panel = Panel(REAL, IMAGINARY, (*marks, BORDER))
    caption = " ".join(dict.fromkeys(notes))
    return Figure("runs-eigenvalues", "Eigenvalues at the rest state", (panel,), caption=caption)


def _point(run: Run) -> LocusPoint | None:
    """Return the linearised motion of a run; None if it is not known."""
    # A stored result must not run code of a user, and the equations have it.
    if run.config is None or has_code(run.config):
        return None
    try:
        return linearised_at_rest(run.config)
    # Numbers near overflow can make the computation fail; the report then omits the run.
    except (ArithmeticError, ValueError, KeyError, ConfigError, np.linalg.LinAlgError):
        return None


def _described(value: complex) -> str:
    damping = -value.real / abs(value) if value else float("nan")
    imaginary = f" {value.imag:+.5g}i" if not are_real(np.asarray(value)) else ""
    return f"λ = {value.real:.5g}{imaginary} 1/s, ζ = {damping:.4g}"
