"""Axes and curves of stored quantities, with the words and symbols of `docs/notation.md`."""

from collections.abc import Iterable, Sequence

from rbstab.mechanics.numbers import Array
from rbstab.report.model.figure import Axis, Figure, Line, Mark, Panel
from rbstab.report.model.palette import COLOURS
from rbstab.report.reading.sources import Run
from rbstab.systems.quantities import BY_NAME

TIME = Axis("time t", "s")

DISPLAY_NAMES = {"lyapunov": "Lyapunov function", "orientation": "Euler angle"}
"""Words for quantities whose stored name is not clear enough."""

Curves = tuple[Axis, Sequence[Mark]]
"""The vertical axis of a panel over time, and its marks."""


def time_figure(name: str, title: str, panels: Iterable[Curves], caption: str = "") -> Figure:
    """Return a figure of panels over time, two side by side.

    Args:
        name: Short, in lower case and hyphens, unique in a report.
        title: Its title.
        panels: The vertical axis of each panel, and its marks.
        caption: Its caption.
    """
    drawn = tuple(Panel(TIME, axis, tuple(marks)) for axis, marks in panels)
    return Figure(name, title, drawn, columns=2, caption=caption, shares_time=True)


def axis_of(
    name: str, component: int | None = None, *, size: bool = False, log: bool = False
) -> Axis:
    """Return the axis of a stored quantity: its word, symbol and unit.

    Args:
        name: The name of the quantity in files.
        component: The number of the component, from 0; None: all components, or a scalar.
        size: Whether the absolute value, or the norm of a vector, is drawn.
        log: Whether the axis is logarithmic.
    """
    quantity = BY_NAME[name]
    symbol = quantity.symbol if component is None else component_of(name, component)
    words = [DISPLAY_NAMES.get(name, name.replace("_", " "))]
    if symbol != "-":
        words.append(f"|{symbol}|" if size and not symbol.startswith("|") else symbol)
    return Axis(" ".join(words), quantity.unit, log=log)


def component_of(name: str, number: int) -> str:
    """Return the symbol of a component of a vector; number counts from 0."""
    symbol = BY_NAME[name].symbol
    return f"{'θ' if symbol == 'Θ' else symbol}{number + 1}"


def components(run: Run, name: str) -> Curves:
    """Return the components of a vector of a run over time."""
    t, columns = run.result["time"], run.result[name].T
    return axis_of(name), [
        Line(t, column, component_of(name, number), colour=number, dash=number)
        for number, column in enumerate(columns)
    ]


def curve_of(run: Run, y: Array, x: Array | None = None) -> Line:
    """Return a curve in the colour of its run.

    Args:
        run: The run.
        y: Its values, shape (n,).
        x: Where they are, shape (n,); the times of the samples, s, if it is not given.
    """
    x, dash = run.result["time"] if x is None else x, run.number // len(COLOURS)
    return Line(x, y, run.label, colour=run.number, dash=dash, group=run.legend)


def acting_parts(run: Run) -> list[str]:
    """Return the names of the parts of a system that have energy, or dissipate it."""
    acting = run.result["energy"].any(axis=0) | run.result["dissipation"].any(axis=0)
    return [str(part) for part in run.result["part"][acting]]


def parts_of(run: Run, names: Sequence[str], values: Array) -> list[Line]:
    """Return the curve of each part of a system that is not zero throughout.

    A part has one colour in all figures; inputs, without energy, follow the others.

    Args:
        run: The run.
        names: The names of the parts.
        values: Their values over time, shape (n, parts).
    """
    colours = list(dict.fromkeys((*acting_parts(run), *names)))
    numbers = [colours.index(name) for name in names]
    return [
        Line(run.result["time"], column, name, colour=number, dash=number // len(COLOURS))
        for name, number, column in zip(names, numbers, values.T, strict=True)
        if column.any()
    ]


def has_guard(run: Run, method: str) -> bool:
    """Whether a run has an element with a method, such as a barrier or a stop."""
    elements = () if run.config is None else run.config.elements.values()
    return any(getattr(element, "method", None) == method for element in elements)
