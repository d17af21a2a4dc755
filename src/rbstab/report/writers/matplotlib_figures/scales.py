"""Scales and ticks of the axes of drawings for paper."""

import textwrap

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FixedLocator, FormatStrFormatter, MaxNLocator

from rbstab.report.model.figure import Axis, Panel
from rbstab.report.model.split_time import FIRST_SHARE, SplitTime
from rbstab.report.model.words import unbroken
from rbstab.report.writers.matplotlib_figures.log_labels import FewMinorLabels

TICK_PITCH = 0.45
"""Smallest distance of ticks along x, in; with less, their labels would overlap."""

CHARACTER_WIDTH = 0.57
"""Mean width of a character, as a fraction of the font size."""


def set_scales(axes: Axes, panel: Panel, width: float) -> None:
    """Set the scales, ends and ticks of both axes of a panel (width in inches)."""
    for axis, name in ((panel.x, "x"), (panel.y, "y")):
        matplotlib_axis = getattr(axes, f"{name}axis")
        if axis.ends is not None:
            getattr(axes, f"set_{name}lim")(*axis.ends)
        if axis.split is not None:
            _set_split_scale(axes, axis.split, width)
        elif axis.log:
            getattr(axes, f"set_{name}scale")("log")
            matplotlib_axis.set_major_formatter(FewMinorLabels())
            matplotlib_axis.set_minor_formatter(FewMinorLabels())
        elif axis.categories:
            _set_category_ticks(axes, name, axis, width)
        else:
            bins = 6 if name == "y" else max(2, min(6, int(width / TICK_PITCH)))
            # With two ticks at least, a short axis would have some between whole numbers.
            counted = {"integer": True, "min_n_ticks": 1} if axis.whole else {}
            locator = MaxNLocator(nbins=bins, steps=[1, 2, 5, 10], **counted)
            matplotlib_axis.set_major_locator(locator)


def _set_split_scale(axes: Axes, split: SplitTime, width: float) -> None:
    """Set a time axis with two scales, ticks of both, and a line between them (width in inches)."""
    axes.set_xscale("function", functions=(split.places, split.times))
    bins = [max(1, int(s * width / TICK_PITCH)) for s in (FIRST_SHARE, 1 - FIRST_SHARE)]
    first, second = (
        np.array(MaxNLocator(nbins=count, steps=[1, 2, 5, 10]).tick_values(*ends))
        for count, ends in zip(bins, ((split.begin, split.at), (split.at, split.end)), strict=True)
    )
    # The first tick of the second part would be too near to the last one of the first part.
    apart = second[split.places(second) > FIRST_SHARE + 0.7 * TICK_PITCH / width]
    axes.xaxis.set_major_locator(FixedLocator([*first[first <= split.at], *apart]))
    axes.xaxis.set_major_formatter(FormatStrFormatter("%g"))
    axes.set_xlim(split.begin, split.end)
    axes.axvline(split.at, color="#7F7F7F", linewidth=0.8, linestyle=(0, (1, 2)))


def _set_category_ticks(axes: Axes, name: str, axis: Axis, width: float) -> None:
    """Set categories as tick labels (width in inches).

    If they would overlap, they are put on several lines; if a word is too long for that, slanted.
    """
    matplotlib_axis = getattr(axes, f"{name}axis")
    labels = [escape_math(label) for label in axis.categories]
    matplotlib_axis.set_ticks(range(len(labels)), labels)
    getattr(axes, f"set_{name}lim")(-0.5, len(axis.categories) - 0.5)
    if name == "y":
        return
    characters = (max(map(len, axis.categories)) + 1) * len(axis.categories)
    letter = CHARACTER_WIDTH * mpl.rcParams["xtick.labelsize"] / 72
    if characters * letter <= width:
        return
    room = int(width / len(labels) / letter) - 1
    if max(len(word) for category in axis.categories for word in category.split()) <= room:
        wrapped = [textwrap.fill(unbroken(category), room) for category in axis.categories]
        matplotlib_axis.set_ticklabels([escape_math(label) for label in wrapped])
    else:
        for label in matplotlib_axis.get_ticklabels():
            label.set(rotation=25, ha="right", rotation_mode="anchor")


def escape_math(text: str) -> str:
    """Escape dollar signs, so that matplotlib does not interpret the text as mathematics."""
    return text.replace("$", r"\$")
