"""Encode texts, arrays and colours for plotly."""

import base64
from typing import Any

import numpy as np

from rbstab.mechanics.numbers import Array

SINGLE = np.finfo(np.float32)


def escaped(text: str) -> str:
    """Escape a text, so that plotly does not interpret it as HTML."""
    return text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")


def packed_array(array: Array) -> dict[str, Any]:
    """Encode an array for plotly's JSON: its bytes in base64.

    Single precision is used if its rounding errors are invisible on a screen. Double precision is
    used if the numbers exceed the range of single precision, or are too close to each other.

    Args:
        array: Shape (n,) or (m, n). Entries that are not finite leave a gap.
    """
    values = np.asarray(array, dtype=float)
    values = np.where(np.isfinite(values), values, np.nan)
    kind = "f4" if _fits_single(values) else "f8"
    packed: dict[str, Any] = {
        "dtype": kind,
        "bdata": base64.b64encode(values.astype(f"<{kind}").tobytes()).decode("ascii"),
    }
    if values.ndim == 2:
        packed["shape"] = ", ".join(str(length) for length in values.shape)
    return packed


def packed_integers(array: Array) -> dict[str, Any]:
    """Encode whole numbers for plotly's JSON, in the fewest bytes.

    Args:
        array: Shape (n,) or (m, n), each from -2³¹ to 2³¹ - 1.
    """
    values = np.asarray(array)
    low, high = int(values.min(initial=0)), int(values.max(initial=0))
    kind = next(k for k in ("i1", "i2", "i4") if np.iinfo(k).min <= low and high <= np.iinfo(k).max)
    packed = {
        "dtype": kind,
        "bdata": base64.b64encode(values.astype(f"<{kind}").tobytes()).decode("ascii"),
    }
    if values.ndim == 2:
        packed["shape"] = ", ".join(str(length) for length in values.shape)
    return packed


def legend_entry(label: str) -> dict[str, Any]:
    """Return the name of a trace, and the group of the entry in the legend that hides it."""
    return {"name": escaped(label), "legendgroup": label} if label else {"name": ""}


def translucent(tint: str, opacity: float = 0.35) -> str:
    """Return a colour that lets through what is behind it; tint is #RRGGBB."""
    red, green, blue = (int(tint[begin : begin + 2], 16) for begin in (1, 3, 5))
    return f"rgba({red}, {green}, {blue}, {opacity})"


def _fits_single(values: Array) -> bool:
    sizes = np.abs(values[np.isfinite(values) & (values != 0)])
    if not len(sizes):
        return True
    if sizes.max() > SINGLE.max or sizes.min() < SINGLE.tiny:
        return False
    spread = float(np.nanmax(values) - np.nanmin(values))
    return bool(spread > 1e4 * SINGLE.eps * sizes.max())
