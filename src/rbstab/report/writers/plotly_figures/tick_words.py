"""The labels of ticks: broken into lines, or upright."""

import re
from collections.abc import Sequence
from typing import NamedTuple

from rbstab.report.model.words import unbroken
from rbstab.report.writers.plotly_figures.text import escaped

JOINTS = re.compile(r"(?<= )|(?<=\w[-_])(?=[A-Za-z])|(?<=[A-Za-z]\.)(?=[A-Za-z])")
"""Where a tick label may be broken: at spaces, hyphens and underscores, and dots between words."""

MAX_TICK_LENGTH = 28
"""Maximum number of characters of a tick label; plotly lays out longer labels badly."""

MAX_TICK_LINES = 5
"""Maximum number of lines of a tick label."""

TICKS = 24
"""Space for ticks with labels of one line, px."""

LETTER, LINE = 6, 14
"""Width of a letter of a tick label, and height of a line, px."""


def tick_label(text: str) -> str:
    """Escape a tick label, and cut it if it is too long."""
    return escaped(text if len(text) <= MAX_TICK_LENGTH else f"{text[: MAX_TICK_LENGTH - 1]}…")


def tick_lines(text: str, room: int, most: int) -> list[str]:
    """Break a tick label into lines, as few as possible.

    Args:
        text: The label, not escaped.
        room: Characters that a line has room for. A longer word has a line of its own.
        most: Maximum number of lines; what is left of the text is cut.
    """
    lines: list[str] = []
    for piece in JOINTS.split(unbroken(text)):
        if lines and len((lines[-1] + piece).rstrip()) <= room:
            lines[-1] += piece
        else:
            lines.append(piece)
    lines = [line.rstrip() for line in lines]
    return lines if len(lines) <= most else [*lines[: most - 1], f"{lines[most - 1]} …"]


class TickWords(NamedTuple):
    """The labels of a horizontal axis of categories.

    texts are their lines, escaped. angle is that of the labels, degrees, and height the space that
    they need, px.
    """

    texts: tuple[str, ...]
    angle: int
    height: int


def tick_words(labels: Sequence[str], room: int) -> TickWords:
    """Lay out the labels of categories: in lines if their words fit, or else upright.

    Args:
        labels: The labels.
        room: Characters that fit between two categories.
    """
    lines = [tick_lines(label, min(room, MAX_TICK_LENGTH), MAX_TICK_LINES) for label in labels]
    upright = max(len(line) for label in lines for line in label) > room + 1
    if upright:
        most = 2 if room * LETTER >= 2 * LINE else 1
        length = MAX_TICK_LENGTH // most
        lines = [tick_lines(label, length, most) for label in labels]
        longest = max(len(line) for label in lines for line in label)
        height = 10 + LETTER * min(longest, MAX_TICK_LENGTH)
    else:
        height = TICKS + LINE * (max(map(len, lines)) - 1)
    texts = tuple("<br>".join(map(tick_label, label)) for label in lines)
    return TickWords(texts, 90 if upright else 0, height)
