"""Axes and curves of stored quantities, labelled as in `docs/notation.md`."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.report.model.figure import Axis, Line, Panel
from rbstab.report.model.palette import COLOURS
from rbstab.report.reading.sources import Run
from rbstab.systems.quantities import BY_NAME

TIME = Axis("time t", "s")

SUBSCRIPTS = "₁₂₃"

COMPONENTS = ("component 1", "component 2", "component 3")

WORDS = {"lyapunov": "Lyapunov function", "lyapunov_rate": "derivative"}
"""Of quantities whose name alone would not say what they are."""


def axis_of(name: str, component: int | None = None, *, size: bool = False) -> Axis:
    """The axis of a stored quantity: its word, its symbol and its unit.

    Args:
        name: Its name in files.
        component: Which component is meant, from 0; None: all, or a scalar.
        size: Whether its size is drawn, on a logarithmic axis.
    """
    quantity = BY_NAME[name]
    symbol = quantity.symbol
    if component is not None:
        symbol = f"{'θ' if symbol == 'Θ' else symbol}{SUBSCRIPTS[component]}"
    words = [WORDS.get(name, name.replace("_", " "))]
    if symbol != "-":
        words.append(f"|{symbol}|" if size and not symbol.startswith("|") else symbol)
    return Axis(" ".join(words), quantity.unit, log=size)


def components(run: Run, name: str) -> Panel:
    """The three components of a quantity of a run over time."""
    t, values = run.result["time"], run.result[name]
    marks = [
        Line(t, values[:, number], label, colour=number, dash=number)
        for number, label in enumerate(COMPONENTS)
    ]
    return Panel(TIME, axis_of(name), tuple(marks))


def scalar(run: Run, name: str, *, size: bool = False) -> Panel:
    """A quantity of a run over time, or its size on a logarithmic axis."""
    values = run.result[name]
    axis = axis_of(name, size=size)
    if name == "lyapunov" and run.counts_work:
        axis = replace(axis, label=f"{axis.label} - ε")
    return Panel(TIME, axis, (Line(run.result["time"], np.abs(values) if size else values),))


def curve_of(run: Run, y: Array, x: Array | None = None) -> Line:
    """A curve of a run among others: its colour is the run's."""
    return Line(
        run.result["time"] if x is None else x,
        y,
        run.label,
        colour=run.number,
        dash=run.number // len(COLOURS),
    )


def overlay(runs: Sequence[Run], name: str, component: int | None = None) -> Panel:
    """A quantity, or one component of it, of several runs over time."""
    marks = [
        curve_of(run, run.result[name] if component is None else run.result[name][:, component])
        for run in having(runs, name)
    ]
    return Panel(TIME, axis_of(name, component), tuple(marks))


def side_by_side(panels: Sequence[Panel]) -> int:
    """In how many columns panels stand: three of them in one row, others in pairs."""
    return 3 if len(panels) == 3 else 2


def sizes(values: Array) -> Array:
    """The lengths of vectors, shape (n, 3), one by one; what overflows is infinite."""
    with np.errstate(all="ignore"):
        return np.linalg.norm(values, axis=1)


def having(runs: Sequence[Run], *names: str) -> list[Run]:
    """Those of the runs that have all these arrays."""
    return [run for run in runs if all(name in run.result for name in names)]
