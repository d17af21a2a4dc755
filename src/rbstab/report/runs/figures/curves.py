"""Axes and curves of stored quantities, with the words and symbols of `docs/notation.md`."""

from collections.abc import Sequence

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.report.model.figure import Axis, Line, Panel
from rbstab.report.model.palette import COLOURS
from rbstab.report.reading.sources import Run
from rbstab.systems.quantities import BY_NAME

TIME = Axis("time t", "s")

DISPLAY_NAMES = {"lyapunov": "Lyapunov function", "orientation": "Euler angle"}
"""Words for quantities whose stored name is not clear enough."""


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
    symbol = quantity.symbol
    if component is not None:
        symbol = component_of(name, component)
    words = [DISPLAY_NAMES.get(name, name.replace("_", " "))]
    if symbol != "-":
        words.append(f"|{symbol}|" if size and not symbol.startswith("|") else symbol)
    return Axis(" ".join(words), quantity.unit, log=log)


def component_of(name: str, number: int) -> str:
    """Return the symbol of a component of a vector; number counts from 0."""
    symbol = BY_NAME[name].symbol
    return f"{'θ' if symbol == 'Θ' else symbol}{number + 1}"


def components(run: Run, name: str) -> Panel:
    """Return the components of a vector of a run over time."""
    t, columns = run.result["time"], run.result[name].T
    curves = (
        Line(t, column, component_of(name, number), colour=number, dash=number)
        for number, column in enumerate(columns)
    )
    return Panel(TIME, axis_of(name), tuple(curves))


def curve_of(run: Run, y: Array, x: Array | None = None) -> Line:
    """Return a curve in the colour of its run."""
    return Line(
        run.result["time"] if x is None else x,
        y,
        run.label,
        colour=run.number,
        dash=run.number // len(COLOURS),
        group=run.legend,
    )


def acting_parts(run: Run) -> list[str]:
    """Return the names of the parts of a system that have energy, or dissipate it."""
    acting = run.result["energy"].any(axis=0) | run.result["dissipation"].any(axis=0)
    return [str(part) for part in run.result["part"][acting]]


def parts_of(run: Run, names: Sequence[str], values: Array) -> list[Line]:
    """Return the curve of each part of a system, columns of values, that is not zero throughout.

    A part has one colour in all figures; inputs, without energy, follow the others.
    """
    colours = list(dict.fromkeys((*acting_parts(run), *names)))
    curves = []
    for name, column in zip(names, values.T, strict=True):
        if column.any():
            number = colours.index(name)
            dash = number // len(COLOURS)
            curves.append(Line(run.result["time"], column, name, colour=number, dash=dash))
    return curves


def norms(values: Array) -> Array:
    """Return the norms of vectors, shape (..., 3); a norm that overflows is infinite."""
    with np.errstate(all="ignore"):
        return np.asarray(np.linalg.norm(values, axis=-1))
