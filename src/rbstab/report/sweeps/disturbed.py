"""How far disturbances tilt the members of a sweep, beside what is proved of all disturbances."""

import numpy as np

from rbstab.experiment.answers.rounded import number
from rbstab.experiment.disturbed.bound import UNITS
from rbstab.mechanics.numbers import Array
from rbstab.report.model.document import Block
from rbstab.report.model.figure import Axis, Band, Figure, Level, Mark, Panel, Points
from rbstab.report.model.palette import BAD, GOOD, OPEN, THIRD
from rbstab.sweep.folder.disturbed import DisturbedAnswers
from rbstab.sweep.proofs.disturbed import LARGER, PROVED

MOST = 2000
"""Of more members of a kind, every second, third, ... is drawn; the worst is."""

ABOVE = 1.08
"""The axes end at so many times the largest values."""


def disturbed_blocks(name: str, answers: DisturbedAnswers | None, command: str) -> list[Block]:
    """Return sentences on the bound that a plan states, and the largest tilts over disturbances.

    Args:
        name: The name of the sweep.
        answers: The answers; None: it states none.
        command: The command that runs a member, without its number.
    """
    if answers is None:
        return []
    sentences = " ".join(f"{word}: {text}." for word, text in answers.statements.items())
    stated, codes = answers.bounds.stated, np.isin(answers.bounds.codes, (PROVED, LARGER))
    # So it is about each member whose load of the only kind is below the bound.
    proved = len(stated.given) == 1 and bool(codes.all()) and answers.proved > 0
    panels = [
        _panel(answers, load.kind, float(bound), proved)
        for load, bound in stated.given.items()
        if _drawn(answers, load.kind).any()
    ]
    if not panels:
        return [sentences]
    shaded = " No motion from these starts is in the shaded area: proved." if proved else ""
    title = "Largest tilt over the size of the disturbance"
    thin = (
        f" Of more than {MOST} members of a kind, only some are drawn." if len(codes) > MOST else ""
    )
    caption = f"{answers.leaving[:1].upper()}{answers.leaving[1:]}.{shaded}{thin}"
    figure = Figure(f"{name}-disturbed", title, tuple(panels), 2, caption=caption, command=command)
    return [sentences, figure]


def _drawn(answers: DisturbedAnswers, kind: str) -> Array:
    """Return which members have a tilt, and a load of a kind that has a largest value."""
    size = answers.bounds.loads.largest[kind]
    return np.isfinite(answers.peaks) & (size > 0) & (size < np.inf)


def _panel(answers: DisturbedAnswers, kind: str, bound: float, shaded: bool) -> Panel:
    """Return the panel of the disturbances of one kind."""
    sizes, peaks = answers.bounds.loads.largest[kind], answers.peaks
    tilt = float(answers.bounds.stated.tilt)
    drawn, proved = _drawn(answers, kind), answers.bounds.codes == PROVED
    right = ABOVE * float(sizes[drawn].max(initial=bound))
    top = ABOVE * float(peaks[drawn].max(initial=tilt))
    x, low, high = np.array([[0.0, bound], [tilt, tilt], [top, top]])
    area = Band(x, low, high, "no motion is here: proved", GOOD)
    marks: list[Mark] = [area] if shaded else []
    groups = (
        (proved, "stays below for ever: proved", GOOD, 0),
        (~proved & ~answers.left, "stayed below in this run", OPEN, 0),
        (answers.left, "tilted farther", BAD, 1),
        (np.arange(len(peaks)) == answers.worst, f"worst: member {answers.worst}", THIRD, 2),
    )
    for chosen, label, colour, symbol in groups:
        places = np.flatnonzero(chosen & drawn)
        places = places[:: 1 + len(places) // MOST]
        members = tuple(places.tolist())
        texts = tuple(f"{label}\nmember {k}" for k in members)
        if members:
            marks.append(
                Points(sizes[places], peaks[places], label, colour, symbol, texts, members)
            )
    marks.append(Level(tilt, f"bound: {number(tilt)} rad"))
    marks.append(Level(bound, f"bound: {number(bound)} {UNITS[kind]}", vertical=True))
    across = Axis(f"largest {kind} of the disturbance", UNITS[kind], ends=(0.0, right))
    return Panel(across, Axis("largest tilt", "rad", ends=(0.0, top)), tuple(marks))
