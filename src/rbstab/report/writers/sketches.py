"""Sketches as SVG, in the colours of the figures."""

import math
from html import escape

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.report.model.document import Sketch
from rbstab.report.model.palette import colour
from rbstab.report.writers.decimate import kept_points

WIDTH, HEIGHT = 300.0, 72.0
"""The frame, in units of the picture."""

MARGIN = 4.0
"""Room around the frame for marks on it."""

ASPECT = (HEIGHT + 2 * MARGIN) / (WIDTH + 2 * MARGIN)
"""The height of a picture over its width."""

MAX_POINTS = int(WIDTH)
"""Maximum number of points of a curve: one for each unit of its width."""

FRAME = "#999999"
"""Grey that is visible on light and dark pages."""


def svg(sketch: Sketch) -> str:
    """Return a sketch as an SVG element; its words are its text for those who do not see it."""
    parts = [
        f'<path d="M0 0V{HEIGHT:g}H{WIDTH:g}" fill="none" stroke="{FRAME}" stroke-width="1"/>',
    ]
    for index, (_, points) in enumerate(sketch.curves):
        path = _path(_placed(points[kept_points(points[:, 0], points[:, 1], MAX_POINTS)]))
        if path:
            parts.append(
                f'<path d="{path}" fill="none" stroke="{colour(index)}" stroke-width="1.6" '
                'stroke-linejoin="round"/>'
            )
    for x, y in _placed(sketch.marks if sketch.marks is not None else np.zeros((0, 2))).tolist():
        parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3.5" fill="{colour(1)}"/>')
    label = escape(sketch.words)
    box = f"{-MARGIN:g} {-MARGIN:g} {WIDTH + 2 * MARGIN:g} {HEIGHT + 2 * MARGIN:g}"
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{box}" role="img" aria-label="{label}">'
        f"{''.join(parts)}</svg>"
    )


def _placed(points: Array) -> Array:
    """Return points of the unit square in the frame, where y points down."""
    return np.column_stack([points[:, 0] * WIDTH, (1.0 - points[:, 1]) * HEIGHT])


def _path(points: Array) -> str:
    """Return a curve in the notation of SVG paths, with its gaps."""
    commands, drawing = [], False
    for x, y in points.tolist():
        if not (math.isfinite(x) and math.isfinite(y)):
            drawing = False
            continue
        commands.append(f"{'L' if drawing else 'M'}{x:.1f} {y:.1f}")
        drawing = True
    return "".join(commands)
