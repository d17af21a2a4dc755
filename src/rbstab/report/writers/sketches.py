"""Sketches as SVG, in the colours of the figures."""

import math
from collections.abc import Sequence
from html import escape
from itertools import islice

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.report.model.document import Sketch
from rbstab.report.model.palette import colour
from rbstab.report.writers.decimate import visible_points

WIDTH, HEIGHT = 300.0, 72.0
"""The frame, in units of the picture."""

MARGIN = 4.0
"""Room around the frame for marks on it."""

ASPECT = (HEIGHT + 2 * MARGIN) / (WIDTH + 2 * MARGIN)
"""The height of a picture over its width."""

FRAME = "#999999"
"""Grey that is visible on light and dark pages."""


def svg(sketch: Sketch) -> str:
    """Return a sketch as an SVG element; its words are its text for those who do not see it."""
    return svg_of_each([sketch])[0]


def svg_of_each(sketches: Sequence[Sketch]) -> list[str]:
    """Return many sketches as `svg` does."""
    curves = [_placed(points) for sketch in sketches for _, points in sketch.curves]
    visible = visible_points(curves, np.array([0.2, 0.2]))
    paths = iter([_path(points[kept]) for points, kept in zip(curves, visible, strict=True)])
    return [_element(sketch, list(islice(paths, len(sketch.curves)))) for sketch in sketches]


def _element(sketch: Sketch, paths: Sequence[str]) -> str:
    """Return a sketch whose curves have these paths."""
    parts = [
        f'<path d="M0 0V{HEIGHT:g}H{WIDTH:g}" fill="none" stroke="{FRAME}" stroke-width="1"/>',
    ]
    for index, path in enumerate(paths):
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
