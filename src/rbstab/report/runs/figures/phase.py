"""Phase portraits of the rotation."""

from collections.abc import Sequence

from rbstab.report.model.figure import Figure, Line, Mark, Panel, Points
from rbstab.report.reading.sources import Run
from rbstab.report.runs.figures.curves import axis_of, curve_of, runs_with


def phase_figure(run: Run) -> Figure:
    """Return the phase portraits of a run, with its start and end."""
    return Figure(
        f"{run.name}-phase", f"Phase portraits: {run.label}", _panels([run], single=True), columns=3
    )


def overlaid_phases(runs: Sequence[Run]) -> Figure:
    """Return the phase portraits of several runs, overlaid."""
    return Figure("runs-phase", "Phase portraits", _panels(runs, single=False), columns=3)


def _panels(runs: Sequence[Run], *, single: bool) -> tuple[Panel, ...]:
    x, y = "orientation", "angular_velocity"
    return tuple(
        Panel(
            axis_of(x, component),
            axis_of(y, component),
            tuple(
                mark
                for run in runs_with(runs, x, y)
                for mark in (_marked(run, component) if single else [_curve(run, component)])
            ),
        )
        for component in range(3)
    )


def _curve(run: Run, component: int) -> Line:
    result = run.result
    return curve_of(
        run, result["angular_velocity"][:, component], result["orientation"][:, component]
    )


def _marked(run: Run, component: int) -> list[Mark]:
    curve = _curve(run, component)
    return [
        Line(curve.x, curve.y),
        Points(curve.x[:1], curve.y[:1], "start", colour=1, symbol=2),
        Points(curve.x[-1:], curve.y[-1:], "end", colour=1, symbol=0),
    ]
