"""Maps: each panel is one picture with a pixel for each cell.

A cell without a value is clear, and shows the pattern behind it.
"""

import base64
import struct
import zlib
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rbstab.mechanics.numbers import Array
from rbstab.report.model.figure import Axis, Cells
from rbstab.report.model.palette import DIVERGING, GAP, VIRIDIS, colour

SHADES = 64
"""The number of colours of a scale of numbers."""

FINE = 1200
"""Pixels along an axis whose cells are not equally wide."""

LINES = (
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 240 240" preserveAspectRatio="none">'
    '<pattern id="lines" width="8" height="8" patternUnits="userSpaceOnUse">'
    f'<path d="M-1 9L9 -1M-1 1L1 -1M7 9L9 7" stroke="{GAP}" stroke-width="1.4"/></pattern>'
    '<rect width="240" height="240" fill="url(#lines)"/></svg>'
)
HATCH = f"data:image/svg+xml;base64,{base64.b64encode(LINES.encode()).decode()}"
"""The picture behind cells without a value: thin diagonal lines."""

PNG = b"\x89PNG\r\n\x1a\n"
"""The first bytes of a PNG file."""


def span_of(cells: Cells) -> tuple[float, float]:
    """Return the values at both ends of the scale of colours."""
    if cells.span is not None and not (cells.scale.log and cells.span[0] <= 0):
        return cells.span
    values = cells.values[shown(cells)]
    if not len(values):
        return (0.1, 1.0) if cells.scale.log else (0.0, 1.0)
    low, high = float(values.min()), float(values.max())
    if low < high:
        return low, high
    return (low / 1.1, high * 1.1) if cells.scale.log else (low - 0.5, high + 0.5)


def tints_of(cells: Cells) -> list[str]:
    """Return the colours of the categories, or those along the scale from its low end on."""
    scale = cells.scale
    if scale.categories:
        return [colour(number) for number in scale.colours or range(len(scale.categories))]
    ends = span_of(cells)
    if scale.middle is None or not ends[0] < scale.middle < ends[1]:
        return _blended(VIRIDIS, np.linspace(0.0, 1.0, SHADES))
    low, middle, high = _place(np.array([ends[0], scale.middle, ends[1]]), scale).tolist()
    reach = max(high - middle, middle - low)
    return _blended(DIVERGING, 0.5 + 0.5 * (np.linspace(low, high, SHADES) - middle) / reach)


def edges_of(centres: Array, axis: Axis) -> Array:
    """Return the edges of columns or rows, from their centres; shape (n + 1,)."""
    places = _place(np.asarray(centres, dtype=float), axis)
    if len(places) == 1:
        around = places + np.arange(-1.0, 2.0)
    else:
        around = np.pad(places, 1, mode="reflect", reflect_type="odd")
    places = 0.5 * (around[1:] + around[:-1])
    return 10.0**places if axis.log else places


def picture(cells: Cells, x: Axis, y: Axis) -> str:
    """Return the picture of a map as an address with its data, clear where a cell has no value.

    Args:
        cells: The cells of the map.
        x: The horizontal axis.
        y: The vertical axis.
    """
    tints = _rgb(tints_of(cells))
    number = np.where(shown(cells), _shades(cells, len(tints)), len(tints))
    rows, columns = pixels(edges_of(cells.y, y), y), pixels(edges_of(cells.x, x), x)
    return _png(number[np.ix_(rows[::-1], columns)].astype(np.uint8), tints)


def shown(cells: Cells) -> NDArray[np.bool_]:
    """Return which cells have a value that the scale of colours can show, shape (m, n)."""
    values = np.asarray(cells.values, dtype=float)
    return np.isfinite(values) & ((values > 0) | (not cells.scale.log))


def _shades(cells: Cells, count: int) -> Array:
    """Return the number of the colour of each cell; any number for those without a value."""
    low, high = span_of(cells)
    values = np.where(shown(cells), cells.values, 0 if cells.scale.categories else low)
    if cells.scale.categories:
        return values
    low, high = _place(np.array([low, high]), cells.scale).tolist()
    share = (_place(values, cells.scale) - low) / (high - low)
    return np.rint(np.clip(share, 0.0, 1.0) * (count - 1))


def pixels(edges: Array, axis: Axis) -> NDArray[np.intp]:
    """Return the cell of each pixel along an axis: one pixel a cell where all are equally wide."""
    places = _place(edges, axis)
    widths = np.diff(places)
    if np.allclose(widths, widths.mean(), rtol=1e-6):
        return np.arange(len(widths))
    centres = places[0] + (np.arange(FINE) + 0.5) / FINE * (places[-1] - places[0])
    return np.clip(np.searchsorted(places, centres, side="right") - 1, 0, len(widths) - 1)


def _place(values: Array, axis: Axis) -> Array:
    return np.log10(values) if axis.log else np.asarray(values, dtype=float)


def _rgb(colours: Sequence[str]) -> NDArray[np.uint8]:
    """Return colours #rrggbb as red, green and blue, shape (n, 3)."""
    return np.array([list(bytes.fromhex(code[1:])) for code in colours], np.uint8)


def _blended(colours: tuple[str, ...], shares: Array) -> list[str]:
    """Return colours along a scale of colours, at shares of its length."""
    anchors = _rgb(colours).astype(float)
    at = np.linspace(0.0, 1.0, len(anchors))
    parts = np.rint(np.stack([np.interp(shares, at, part) for part in anchors.T], axis=1))
    return [f"#{red:02x}{green:02x}{blue:02x}" for red, green, blue in parts.astype(int)]


def _png(image: NDArray[np.uint8], tints: NDArray[np.uint8]) -> str:
    """Return an image of numbers of colours as a PNG in an address; one number more is clear."""
    high, wide = image.shape
    head = struct.pack(">IIBBBBB", wide, high, 8, 3, 0, 0, 0)
    lines = np.concatenate([np.zeros((high, 1), np.uint8), image], axis=1)
    palette = bytes(tints.ravel()) + b"\0\0\0"
    parts = {
        b"IHDR": head,
        b"PLTE": palette,
        b"tRNS": b"\xff" * len(tints) + b"\0",
        b"IDAT": zlib.compress(lines.tobytes(), 9),
        b"IEND": b"",
    }
    chunks = b"".join(
        struct.pack(">I", len(data)) + tag + data + struct.pack(">I", zlib.crc32(tag + data))
        for tag, data in parts.items()
    )
    png = base64.b64encode(PNG + chunks).decode()
    return f"data:image/png;base64,{png}"
