"""Figures of a few marks, drawn by matplotlib."""

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg

from rbstab.report.model.figure import (
    Axis,
    Figure,
    Panel,
)
from rbstab.report.writers.matplotlib_figures.renderer import draw_figure

X = np.linspace(0.5, 2.0, 7)


Y = np.sin(X)


PLAIN = Axis("q")


def figure_of(*marks, x=PLAIN, y=PLAIN, **options):
    return Figure("f", "F", (Panel(x, y, marks, **options),))


def axes_of(figure):
    return draw_figure(figure).axes[0]


def tight_box_of(axes):
    box = axes.get_tightbbox()
    assert box is not None
    return box


def no_overlap(drawing, texts):
    """Return whether no text overlaps another one."""
    FigureCanvasAgg(drawing).draw()
    boxes = [text.get_window_extent() for text in texts if text.get_text()]
    return all(not a.overlaps(b) for k, a in enumerate(boxes) for b in boxes[:k])
