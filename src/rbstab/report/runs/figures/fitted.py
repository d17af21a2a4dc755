"""The figure of a fit: what was measured, the fitted motion, and the residuals."""

from rbstab.experiment.tuning.fitted import Fitted
from rbstab.report.model.figure import MUTED, Axis, Figure, Level, Line, Panel, Points
from rbstab.report.runs.figures.curves import TIME


def fitted_figure(fit: Fitted) -> Figure:
    """Return two panels for each measured column: the motion, and its residuals.

    The fitted motion is joined by straight lines between the measured times. The levels beside the
    residuals are at twice the scatter.
    """
    panels, t = [], fit.measured.times
    values = fit.measured.values.T, fit.computed.T, fit.residuals.T
    for column, measured, computed, residuals in zip(fit.columns, *values, strict=True):
        points = Points(t, measured, "measured", MUTED), Line(t, computed, "fitted")
        panels.append(Panel(TIME, Axis(column.name, column.unit), points))
        axis, end = Axis(f"residual of {column.name}", column.unit), 2 * column.scatter
        shown = Points(t, residuals, "residual", MUTED), Level(end), Level(-end)
        panels.append(Panel(TIME, axis, shown))
    return Figure("fit", "", tuple(panels), columns=2, shares_time=True)
