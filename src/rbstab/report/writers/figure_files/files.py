"""Write one figure of a report to a file of its own."""

from dataclasses import replace
from pathlib import Path

from rbstab.report.model.document import Report
from rbstab.report.model.figure import Axis, Figure
from rbstab.report.writers.figure_files.data import csv_of

FORMS = ("svg", "pdf", "png", "csv")
"""The endings of the files."""

DOTS_PER_INCH = 300


def figures_of(report: Report) -> dict[str, Figure]:
    """Return the figures of a report by their names, in their order."""
    blocks = (block for section in report.sections for block in section.blocks)
    return {block.name: block for block in blocks if isinstance(block, Figure)}


def figure_bytes(
    figure: Figure, form: str, *, column: bool = False, linear_time: bool = False
) -> bytes:
    """Return a figure as the content of a file.

    Args:
        figure: The figure. Its title and caption are left to the text that it will stand in.
        form: One of `FORMS`. The drawings are 170 mm wide; `csv` has the data.
        column: Whether a drawing is 80 mm wide, for one column of a paper.
        linear_time: Whether the whole time has one scale, also where a fast transient has its own.
    """
    if form == "csv":
        return csv_of(figure).encode("utf-8", "backslashreplace")
    # Imported late: matplotlib is slow to import.
    from rbstab.report.writers.matplotlib_figures.renderer import drawing, png

    axes = [_time_axis(panel.x, linear=linear_time) for panel in figure.panels]
    panels = (replace(panel, x=axis) for panel, axis in zip(figure.panels, axes, strict=True))
    figure = replace(figure, panels=tuple(panels))
    if form == "png":
        return png(figure, dpi=DOTS_PER_INCH, column=column)
    return drawing(figure, form, column=column)


def _time_axis(axis: Axis, *, linear: bool) -> Axis:
    """Return an axis for a drawing without its caption, which would explain two scales."""
    if axis.split is None or linear:
        return replace(axis, split=None)
    return replace(axis, label=f"{axis.label}, other scale from {axis.split.at:g} on")


def form_of(path: Path) -> str | None:
    """Return the form of a file by its ending; None for another ending."""
    ending = path.suffix.lower().removeprefix(".")
    return ending if ending in FORMS else None
