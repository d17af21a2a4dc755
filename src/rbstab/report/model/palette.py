"""The colours of all figures, told apart by people with any kind of colour vision.

The set is that of Okabe and Ito (https://jfly.uni-koeln.de/color/), without yellow, which is too
faint on white, and with grey in place of black, which would vanish on a dark page.
"""

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#7F7F7F")
"""Of curves, points and bars; their numbers go round."""

SCALE = "viridis"
"""The name, in both libraries, of the scale of maps: even in lightness, safe for all eyes."""


def colour(number: int) -> str:
    """The colour of a number."""
    return COLOURS[number % len(COLOURS)]
