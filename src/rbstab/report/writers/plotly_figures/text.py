"""Texts and arrays as plotly takes them."""

import base64
from typing import Any

import numpy as np

from rbstab.mechanics.numbers import Array

MAX_TICK_LENGTH = 28
"""Letters of a word at an axis; plotly loses its way among longer ones."""

SINGLE = np.finfo(np.float32)


def plain(text: str) -> str:
    """A text that plotly shows as it stands: of what it reads as markup, nothing is left."""
    return text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")


def tick(text: str) -> str:
    """A word at an axis, as `plain`, cut where it is too long."""
    return plain(text if len(text) <= MAX_TICK_LENGTH else f"{text[: MAX_TICK_LENGTH - 1]}…")


def numbers(array: Array) -> dict[str, Any]:
    """An array as plotly reads it from JSON: its bytes, in base64.

    In single precision where that tells the numbers apart as well as any screen can; in double
    precision where they leave its range, or lie so close to each other that it could not.

    Args:
        array: Shape (n,) or (m, n). What is not finite leaves a gap.
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


def _fits_single(values: Array) -> bool:
    sizes = np.abs(values[np.isfinite(values) & (values != 0)])
    if not len(sizes):
        return True
    if sizes.max() > SINGLE.max or sizes.min() < SINGLE.tiny:
        return False
    spread = float(np.nanmax(values) - np.nanmin(values))
    return bool(spread > 1e4 * SINGLE.eps * sizes.max())
