"""Axes and curves of stored quantities, with the words and symbols of `docs/notation.md`."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rbstab.experiment.own_states import own_states_of
from rbstab.experiment.summary import lyapunov_function_of
from rbstab.mechanics.numbers import Array
from rbstab.report.model.figure import Axis, Line, Panel
from rbstab.report.model.palette import COLOURS
from rbstab.report.reading.element_states import state_in_file
from rbstab.report.reading.sources import Run
from rbstab.systems.quantities import BY_NAME, Quantity, is_element_state

TIME = Axis("time t", "s")

FORCES = ("contact_force", "stabilizing_force", "stabilizing_couple")
"""Quantities that a sliding connector makes jump."""

DISPLAY_NAMES = {"lyapunov": "Lyapunov function", "lyapunov_rate": "derivative"}
"""Words for quantities whose stored name is not clear enough."""


def axis_of(
    name: str,
    component: int | None = None,
    *,
    magnitude: bool = False,
    quantity: Quantity | None = None,
) -> Axis:
    """Return the axis of a stored quantity: its word, symbol and unit.

    Args:
        name: The name of the quantity in files.
        component: The number of the component, from 0; None: all components, or a scalar.
        magnitude: Whether absolute values are drawn, on a logarithmic axis.
        quantity: The quantity; needed for an own state of a named element.
    """
    quantity = quantity or BY_NAME[name]
    symbol = quantity.symbol
    if component is not None:
        symbol = component_of(symbol, component)
    words = [DISPLAY_NAMES.get(name, name.replace("_", " ").replace(".", ", "))]
    if symbol != "-":
        words.append(f"|{symbol}|" if magnitude and not symbol.startswith("|") else symbol)
    return Axis(" ".join(words), quantity.unit, log=magnitude)


def component_of(symbol: str, number: int) -> str:
    """Return the symbol of a component of a vector; number counts from 0."""
    return f"{'θ' if symbol == 'Θ' else symbol.strip('-')}{number + 1}"


def quantity_in(run: Run, name: str) -> Quantity:
    """Return the quantity of an array of a run."""
    if is_element_state(name):
        return state_in_file(name, run.result.variables[name])
    return BY_NAME[name]


def element_states(run: Run) -> tuple[str, ...]:
    """Return the names of the own states of named elements of a run."""
    return own_states_of(run.result)


def components(run: Run, name: str) -> Panel:
    """Return the components of a vector of a run over time."""
    t, values, quantity = run.result["time"], run.result[name], quantity_in(run, name)
    curves = (
        Line(t, column, component_of(quantity.symbol, number), colour=number, dash=number)
        for number, column in enumerate(values.T)
    )
    marks = [stepped(run, curve) if name in FORCES else curve for curve in curves]
    return Panel(TIME, axis_of(name, quantity=quantity), tuple(marks))


def scalar(run: Run, name: str, *, magnitude: bool = False) -> Panel:
    """Return a scalar of a run over time, or its absolute value on a logarithmic axis."""
    values = run.result[name]
    axis = axis_of(name, magnitude=magnitude)
    if name == "lyapunov" and run.stores_v_minus_work:
        v = Line(run.result["time"], lyapunov_function_of(run.result), "v")
        return Panel(TIME, axis, (v, replace(balanced(run), label="v - ε")))
    return Panel(TIME, axis, (Line(run.result["time"], np.abs(values) if magnitude else values),))


WORK_NOTE = (
    "ε is the work of the contact force on a surface s = F + κE. v - ε (dotted) is what the "
    "equations balance: its rate is v', and it does not end at zero. v need not fall all the time, "
    "and may end below zero, beside the rest state from which it counts."
)
"""What v - ε is, for captions."""


def balanced(run: Run) -> Line:
    """Return v - ε of a run that stores it, beside the curve of v."""
    return replace(curve_of(run, run.result["lyapunov"]), label=f"v - ε of {run.label}", dash=2)


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


def overlay(runs: Sequence[Run], name: str, component: int | None = None) -> Panel:
    """Return a quantity, or one component of it, of several runs over time."""
    shown = runs_with(runs, name)
    values = [run.result[name] for run in shown]
    curves = [
        curve_of(run, every if component is None else every[:, component])
        for run, every in zip(shown, values, strict=True)
    ]
    if name in FORCES:
        curves = [stepped(*pair) for pair in zip(shown, curves, strict=True)]
    quantity = quantity_in(shown[0], name)
    return Panel(TIME, axis_of(name, component, quantity=quantity), tuple(curves))


JUMP, JUMPING = 0.1, 0.5
"""A curve jumps where it changes by this share of its range between two samples. If jumps make up
this share of all its change, its samples are joined by steps."""


def stepped(run: Run, curve: Line) -> Line:
    """Return a curve of a run, in steps if a sliding connector makes it jump.

    Slanted lines between the samples would show a ramp that is not there.
    """
    if "mode" not in run.result:
        return curve
    with np.errstate(all="ignore"):
        changes = np.abs(np.diff(curve.y[np.isfinite(curve.y)]))
        limit = JUMP * (np.ptp(curve.y[np.isfinite(curve.y)]) if len(changes) else 0.0)
        jumps = changes[changes > limit].sum() > JUMPING * changes.sum()
    return replace(curve, step=bool(jumps))


BUSY = 60
"""A curve that turns so often may cover others."""


def layered(panels: Sequence[Panel]) -> tuple[Panel, ...]:
    """Return panels of curves in which all are seen: busy curves are behind the others.

    A run is busy if one of its curves turns at least `BUSY` times. Of busy runs, the one that moves
    most is behind. It has the same place in all panels.

    Args:
        panels: Panels that have curves only, with the same labels.
    """
    curves = [[mark for mark in panel.marks if isinstance(mark, Line)] for panel in panels]
    moved: dict[str, float] = {}
    busy: set[str] = set()
    for shown in curves:
        most = max((_variation(curve.y) for curve in shown), default=0.0) or 1.0
        for curve in shown:
            moved[curve.label] = moved.get(curve.label, 0.0) + _variation(curve.y) / most
            if _turns(curve.y) >= BUSY:
                busy.add(curve.label)
    order = sorted(moved, key=lambda label: (label in busy, moved[label]))
    depths = {label: depth for depth, label in enumerate(order) if label in busy}
    return tuple(
        replace(panel, marks=tuple(replace(c, depth=depths.get(c.label, 0)) for c in shown))
        for panel, shown in zip(panels, curves, strict=True)
    )


def _turns(values: Array) -> int:
    """Return how often a curve turns from rising to falling, or back, by more than a hundredth."""
    finite = values[np.isfinite(values)]
    if len(finite) < 3:
        return 0
    steps = np.diff(finite)
    moved = np.sign(steps[np.abs(steps) > 0.01 * np.abs(finite).max()])
    return int(np.count_nonzero(np.diff(moved)))


def _variation(values: Array) -> float:
    """Return the way that a value goes up and down in total; 0 if it overflows."""
    with np.errstate(all="ignore"):
        way = float(np.abs(np.diff(values[np.isfinite(values)])).sum())
    return way if np.isfinite(way) else 0.0


def column_count(panels: Sequence[Panel]) -> int:
    """Return the number of columns: 3 for three panels, otherwise 2."""
    return 3 if len(panels) == 3 else 2


def norms(values: Array) -> Array:
    """Return the norms of vectors, shape (n, 3); a norm that overflows is infinite."""
    with np.errstate(all="ignore"):
        return np.linalg.norm(values, axis=1)


def runs_with(runs: Sequence[Run], *names: str) -> list[Run]:
    """Return the runs that have all these arrays."""
    return [run for run in runs if all(name in run.result for name in names)]
