"""Results in one line, and as small HTML cards, for the interpreter and for notebooks.

Texts of results are untrusted: they are printable in a line, and escaped in a card.
"""

from collections.abc import Iterable, Mapping, Sequence
from html import escape
from importlib import import_module
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

MAX_TEXT = 200
"""The most characters of a text in a line or a card."""

WIDTH, HEIGHT = 320, 90
"""The size of a plot, px."""

MAX_POINTS = 300
"""The most points of a curve; of more, the highest and the lowest of each group are kept."""

_CARD = (
    '<div style="border:1px solid #8888;border-radius:6px;padding:0.6em 0.9em;'
    'display:inline-block;font-family:sans-serif;font-size:0.9em">'
)


def line(kind: str, title: str, facts: Sequence[str]) -> str:
    """Return `<rbstab.Result "A title": completed, 401 samples>`."""
    name = f' "{printable(title)}"' if title else ""
    return f"<rbstab.{kind}{name}: {', '.join(map(printable, facts))}>"


def card(kind: str, title: str, facts: Iterable[tuple[str, str]], plot: str = "") -> str:
    """Return an HTML card: a heading, a line for each fact, and a plot from `curve` or `bar`."""
    rows = "".join(
        f'<tr><td style="text-align:left;padding-right:1em;opacity:0.7">{_html(name)}</td>'
        f'<td style="text-align:left">{_html(value)}</td></tr>'
        for name, value in facts
    )
    heading = f"<strong>{_html(title or 'untitled')}</strong> <small>rbstab.{kind}</small>"
    return f"{_CARD}{heading}<table>{rows}</table>{plot}</div>"


def curve(x: NDArray[Any], y: NDArray[Any], label: str) -> str:
    """Return a curve as SVG; empty if it has fewer than two finite points."""
    finite = np.isfinite(x) & np.isfinite(y)
    x, y = x[finite], y[finite]
    if len(x) < 2:
        return ""
    kept = _kept(y)
    x, y = x[kept], y[kept]
    with np.errstate(all="ignore"):
        across = (x - x[0]) / (x[-1] - x[0]) * WIDTH
        up = HEIGHT - (y - y.min()) / (np.ptp(y) or 1.0) * HEIGHT
    if not (np.isfinite(across).all() and np.isfinite(up).all()):
        return ""
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(across, up, strict=True))
    line_ = f'<polyline points="{points}" fill="none" stroke="#1f77b4" stroke-width="1.5"/>'
    return _svg(line_, f"{label}: {y.min():.4g} to {y.max():.4g}")


def bar(counts: Mapping[str, int]) -> str:
    """Return a bar as SVG, with a part for each count, the first one blue and the others grey."""
    total, left, parts = sum(counts.values()), 0.0, ""
    for index, count in enumerate(counts.values()):
        width = WIDTH * count / total
        colour = "#1f77b4" if index == 0 else f"hsl(0,0%,{50 + 12 * index % 40}%)"
        parts += f'<rect x="{left:.1f}" width="{width:.1f}" height="14" fill="{colour}"/>'
        left += width
    label = ", ".join(f"{count} {word}" for word, count in counts.items())
    return _svg(parts, label, 14) if total else ""


def printable(text: object) -> str:
    """Return a text of any origin on one line, cut if it is long."""
    shown = "".join(c if c.isprintable() else "?" for c in str(text)[: MAX_TEXT + 1])
    return shown if len(shown) <= MAX_TEXT else f"{shown[: MAX_TEXT - 1]}…"


def optional_module(name: str, extra: str) -> ModuleType:
    """Import a package that only an extra of the installation has.

    Raises:
        ImportError: It is not installed; the message has the command that installs it.
    """
    try:
        return import_module(name)
    except ModuleNotFoundError as error:
        raise ImportError(
            f'this needs the package {error.name}. Run: pip install "rbstab[{extra}]"',
            name=error.name,
        ) from error


def _kept(y: NDArray[Any]) -> NDArray[Any]:
    """Return the indices of the points to draw: no peak is left out."""
    if len(y) <= MAX_POINTS:
        return np.arange(len(y))
    groups = np.array_split(np.arange(len(y)), MAX_POINTS // 2)
    ends = [index for g in groups for index in (g[y[g].argmin()], g[y[g].argmax()])]
    return np.unique([0, *ends, len(y) - 1])


def _svg(content: str, label: str, height: int = HEIGHT) -> str:
    text = _html(label)
    return (
        f'<svg width="{WIDTH + 2}" height="{height + 2}" viewBox="-1 -1 {WIDTH + 2} {height + 2}" '
        f'role="img" aria-label="{text}" style="display:block;margin-top:0.4em">'
        f"<title>{text}</title>{content}</svg><small>{text}</small>"
    )


def _html(text: object) -> str:
    return escape(printable(text))
