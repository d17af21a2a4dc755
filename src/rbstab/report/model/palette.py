"""The colours of all figures; people with any kind of colour vision can tell them apart.

They are the colours of Okabe and Ito (https://jfly.uni-koeln.de/color/), with two changes. Yellow
is omitted: it is too faint on white. Grey replaces black, which would be invisible on a dark page.
"""

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#7F7F7F")
"""Colours of curves, points and bars; they repeat after the last one."""

SCALE = "viridis"
"""Name of the colour map of maps, in both libraries.

It is perceptually uniform, and readable with any kind of colour vision.
"""

GAPS = ("#B4B4B4", "#6E6E6E", "#D9D9D9", "#8F8F8F")
"""Tones of the cells of a map that have no value, by the reason; the colour map has no grey."""


def colour(number: int) -> str:
    """Return the colour with the given number."""
    return COLOURS[number % len(COLOURS)]


def gap_tone(number: int) -> str:
    """Return the tone of the cells without a value for the reason with the given number."""
    return GAPS[number % len(GAPS)]
