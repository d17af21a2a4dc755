"""A report with a block of every kind, and a report whose texts all look like markup."""

import numpy as np

from rbstab.report.model.document import (
    Animation,
    Block,
    Cell,
    Head,
    Report,
    Section,
    Solid,
    Table,
    Unread,
)
from rbstab.report.model.figure import (
    Axis,
    Band,
    Cells,
    Figure,
    Level,
    Line,
    Panel,
    Points,
    Shares,
    Stack,
)

HOSTILE = (
    "</script><script>alert(1)</script><img src=x onerror=alert(2)><b>bold</b> &lt; "
    "\u2028 ' \" {{ 7*7 }}"
)

TIME = Axis("time t", "s")
END = 2.0
"""s: the last time in the figures and motions."""


def figures():
    """Return figures with every kind of mark."""
    t = np.linspace(0, END, 41)
    x, y = np.array([1.0, 10.0, 100.0]), np.array([0.0, 1.0])
    amounts = np.array([[0.1, 1.0, 10.0], [np.nan, 2.0, 3.0]])
    kinds = np.array([[0.0, 1.0, 0.0], [1.0, np.nan, 1.0]])
    over_time = Figure(
        "over-time",
        "Over time",
        (
            Panel(
                TIME,
                Axis("E", "m"),
                (
                    Line(t, np.sin(t), "first", 0),
                    Line(t, np.cos(t), "second", 1, dash=1),
                    Level(0.5, "bound"),
                ),
                "A panel",
            ),
            Panel(TIME, Axis("v", "J", log=True), (Line(t, np.exp(-t), "first", 0, step=True),)),
            Panel(
                TIME,
                Axis("energy", "J"),
                (Stack(t, np.stack([np.exp(-t), -np.exp(-2 * t)], axis=1), ("one", "two")),),
            ),
        ),
        columns=2,
        shares_time=True,
    )
    maps = Figure(
        "maps",
        "Maps",
        (
            Panel(
                Axis("K", "N/m", log=True),
                Axis("Ω", "rad/s"),
                (Cells(x, y, amounts, Axis("time", "s", log=True)),),
            ),
            Panel(
                Axis("K", "N/m", log=True),
                Axis("Ω", "rad/s"),
                (Cells(x, y, kinds, Axis("status", categories=("ended", "left <b>"))),),
            ),
        ),
        columns=2,
    )
    counts = Figure(
        "counts",
        "Counts",
        (
            Panel(
                Axis("time", "s"),
                Axis("members"),
                (
                    Band(
                        np.array([0.5, 1.0, 2.0]),
                        np.array([1.0, 2.0, 1.5]),
                        np.array([2.0, 2.5, 4.0]),
                        "between",
                    ),
                    Level(1.5, "", True),
                ),
            ),
            Panel(
                Axis("share", ends=(0.0, 1.0)),
                Axis("", categories=("second", "first")),
                (Shares(np.array([[3, 1], [0, 5]]), ("good", "bad"), (0, 1)),),
            ),
            Panel(
                Axis("E1", "m"),
                Axis("E2", "m"),
                (Points(np.array([0.0, 1.0]), np.array([0.0, 1.0]), "ends", texts=("a", "b")),),
            ),
        ),
        columns=2,
    )
    return over_time, maps, counts


def motion(name="run-1"):
    """Return the motion of a tetrahedron along x, with half a turn about z."""
    times = np.linspace(0, END, 21)
    half = np.pi * times / END / 2
    zero = np.zeros_like(half)
    corners = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, -0.5], [-0.5, 0.8, -0.5], [-0.5, -0.8, -0.5]])
    return Animation(
        name,
        f"the run {name}",
        times,
        np.stack([times, zero, zero], axis=1),
        np.stack([np.cos(half), zero, zero, np.sin(half)], axis=1),
        Solid(corners, np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])),
        np.array([0.1, 0.0, -0.4]),
        np.array([0.1, 0.0, -0.4]),
    )


def table(rows=3, columns=12):
    """Return a wide table whose numbers sort differently from their texts."""
    values = [10.0, 9.0, float("nan"), 2e-3, *map(float, range(rows))][:rows]
    names = ["beta", "alpha", "gamma", *(f"row {n}" for n in range(rows))][:rows]
    heads = (Head("name"), *(Head(f"number {n}", "m", True) for n in range(columns - 1)))
    cells = tuple(
        (Cell(name, target="figures"), *(Cell(f"{value:g}", value, "good"),) * (columns - 1))
        for name, value in zip(names, values, strict=True)
    )
    return Table("numbers", "Numbers", heads, cells, "A note.")


def report():
    """Return a report with tables, motions, figures and an unread file."""
    return Report(
        "A report",
        "2026-01-02T03:04:05+00:00",
        "rbstab report results/a.h5",
        (
            Section("tables", "Tables", ("A paragraph.", table())),
            Section("motions", "Motions", (motion("run-1"), motion("run-2"))),
            Section("figures", "Figures", figures()),
        ),
        (Unread("results/broken.h5", "it is damaged"),),
    )


def hostile_report():
    """Return a report in which every text is hostile markup."""
    line = Line(np.arange(3.0), np.arange(3.0), HOSTILE)
    cells = Cells(
        np.arange(2.0), np.arange(2.0), np.zeros((2, 2)), Axis(HOSTILE, categories=(HOSTILE,))
    )
    points = Points(np.arange(2.0), np.arange(2.0), HOSTILE, texts=(HOSTILE, HOSTILE))
    axis = Axis(HOSTILE, HOSTILE, categories=(HOSTILE, HOSTILE))
    panel = Panel(axis, Axis(HOSTILE, HOSTILE), (line, points, Level(1.0, HOSTILE)), HOSTILE)
    shown = Figure("figure", HOSTILE, (panel, Panel(axis, axis, (cells,))), 2, HOSTILE)
    table = Table(
        "odd",
        HOSTILE,
        (Head(HOSTILE, HOSTILE),),
        ((Cell(HOSTILE),), (Cell(HOSTILE, 1.0, "bad", "part"),)),
        HOSTILE,
    )
    view = motion()
    moving = Animation(**{**vars(view), "title": HOSTILE})
    blocks: tuple[Block, ...] = (HOSTILE, table, shown, moving)
    return Report(
        HOSTILE, HOSTILE, HOSTILE, (Section("part", HOSTILE, blocks),), (Unread(HOSTILE, HOSTILE),)
    )
