"""The colours of all figures; people with any kind of colour vision can tell them apart.

They are the colours of Okabe and Ito (https://jfly.uni-koeln.de/color/), with two changes. Yellow
is omitted: it is too faint on white. Grey replaces black, which would be invisible on a dark page.
"""

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#7F7F7F")
"""Colours of curves, points and bars; they repeat after the last one."""

GOOD, BAD, OPEN, UNTRIED, UNKNOWN, SECOND, THIRD = range(-1, -8, -1)
"""Numbers of the colours of answers in maps: what is good, what is not, what is not decided, what
was not tried, where the answer itself failed; and what is good in a second and in a third way.

The colour of a curve says which curve it is; that of an answer says what it is.
"""

ANSWERS = {
    GOOD: "#0B6E4F",
    BAD: "#D55E00",
    OPEN: "#999999",
    UNTRIED: "#DADADA",
    UNKNOWN: "#F0C387",
    SECOND: "#56B4E9",
    THIRD: "#661199",
}
"""The colours of answers: green, red, grey and pale grey, sand; pale blue and purple.

Not those of curves: their green looks as their grey to some readers, and two of them are blue.
"""

VIRIDIS = (
    *("#440154", "#482475", "#414487", "#355f8d", "#2a788e", "#21918c"),
    *("#22a884", "#44bf70", "#7ad151", "#bddf26", "#fde725"),
)
"""The colour map of maps: perceptually uniform, and readable with any kind of colour vision."""

DIVERGING = ("#2166AC", "#92C5DE", "#F7F7F7", "#C2A5CF", "#762A83")
"""The colours of a scale that diverges from its middle: blue, white, purple.

They are readable with any kind of colour vision, and no mark on a map has them.
"""

GAP = "#8a8f96"
"""The colour of the pattern of cells that have no value; no scale has it."""

CASING, CASED = "#FFFFFF", "#303030"
"""The colours of the edges of a curve that shows on areas of any colour, and of its middle."""

CASING_WIDTH = 3.0
"""The width of such a curve with its edges, over that of its middle."""


def colour(number: int) -> str:
    """Return the colour with the given number; those of answers have numbers below zero."""
    return ANSWERS[number] if number < 0 else COLOURS[number % len(COLOURS)]


def area_colour(number: int) -> str:
    """Return the colour of the area with the given number; after the last colour it is paler.

    Lines that repeat a colour are dashed; areas cannot be.
    """
    if number < len(COLOURS):
        return colour(number)
    red, green, blue = ((component + 255) // 2 for component in rgb(number))
    return f"#{red:02X}{green:02X}{blue:02X}"


def contrast(number: int) -> str:
    """Return black or white, whichever is easier to read on the colour with the given number."""
    # The luminance of WCAG 2; at 0.18 black and white have the same contrast.
    parts = [part / 255 for part in rgb(number)]
    linear = [p / 12.92 if p <= 0.04045 else ((p + 0.055) / 1.055) ** 2.4 for p in parts]
    luminance = sum(weight * p for weight, p in zip((0.2126, 0.7152, 0.0722), linear, strict=True))
    return "#000000" if luminance > 0.18 else "#FFFFFF"


def rgb(number: int) -> tuple[int, int, int]:
    """Return the colour with the given number as red, green and blue, 0 to 255."""
    red, green, blue = bytes.fromhex(colour(number)[1:])
    return red, green, blue
