"""Single figures as files: drawings for papers, and their data."""

import json
import re
from dataclasses import replace

from rbstab.report.model.document import Report
from rbstab.report.model.figure import Figure
from rbstab.report.writers.series import csv_of
from rbstab.report.writers.vega.specification import specification

FORMS = ("svg", "pdf", "png", "csv")
"""The endings of the files."""

PIXELS_PER_INCH = 96
DOTS_PER_INCH = 300

WIDE, COLUMN = (millimetres / 25.4 * PIXELS_PER_INCH for millimetres in (170, 80))
"""The widths of drawings in pixels: that of a page, and of one column of a paper."""

_SIZE = re.compile(r' width="([\d.]+)" height="([\d.]+)"')
_NAME = re.compile(r"\b(clip|gradient_)\d+\b")


def figures_of(report: Report) -> dict[str, Figure]:
    """Return the figures of a report by their names, in their order."""
    blocks = (block for section in report.sections for block in section.blocks)
    return {block.name: block for block in blocks if isinstance(block, Figure)}


def figure_bytes(figure: Figure, form: str, *, column: bool = False) -> bytes:
    """Return a figure as the content of a file.

    Args:
        figure: The figure. Its title and caption are left to the text that it will stand in.
        form: One of `FORMS`. The drawings are 170 mm wide; `csv` has the data.
        column: Whether a drawing is 80 mm wide, for one column of a paper.
    """
    if form == "csv":
        return csv_of(figure).encode("utf-8", "backslashreplace")
    # Imported late: a plain install lacks it.
    import vl_convert

    if column:
        figure = replace(figure, columns=1)
    wanted = COLUMN if column else WIDE
    spec = specification(figure, width=wanted)
    drawn = vl_convert.vegalite_to_svg(json.dumps(spec), allowed_base_urls=[])
    svg = _sized(_renumbered(drawn), wanted)
    if form == "svg":
        return svg.encode()
    if form == "pdf":
        return bytes(vl_convert.svg_to_pdf(svg))
    return bytes(vl_convert.svg_to_png(svg, scale=DOTS_PER_INCH / PIXELS_PER_INCH))


def _sized(svg: str, width: float) -> str:
    """Return a drawing in a width: labels of axes may have made it wider or narrower."""

    def sized(match: re.Match[str]) -> str:
        wide, high = map(float, match.groups())
        return f' width="{width:.2f}" height="{high * width / wide:.2f}"'

    return _SIZE.sub(sized, svg, count=1)


def _renumbered(svg: str) -> str:
    """Return a drawing with names that do not depend on the drawings before it."""
    names: dict[str, str] = {}
    return _NAME.sub(lambda m: names.setdefault(m[0], f"{m[1]}{len(names)}"), svg)
