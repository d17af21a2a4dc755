"""Curves of outcomes and quantities along one parameter."""

from dataclasses import replace

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.report.model.document import Block
from rbstab.report.model.figure import Axis, Figure, Line, Mark, Panel, Points
from rbstab.report.sweeps.conditions.paired_conditions import Slice
from rbstab.report.sweeps.maps.figures import FIRST
from rbstab.report.sweeps.members import OUTCOMES, POINT_COLOURS, Members
from rbstab.report.sweeps.parameters import Parameter
from rbstab.report.sweeps.quantities import mapped, varies

MAX_POINTS = 500
"""Up to this many outcomes are drawn as points, more as a line."""


def curves(name: str, members: Members, parameter: Parameter, slices: list[Slice]) -> list[Block]:
    """Return a figure of the quantities along one parameter, with a curve for each slice.

    Args:
        name: The name of the sweep.
        members: The members.
        parameter: The parameter along the horizontal axis.
        slices: The members of each curve; with a single slice, E has a curve for each axis.
    """
    orders = [_order(parameter, part.chosen) for part in slices]
    panels: dict[str, Panel] = {}
    if np.count_nonzero(members.outcome_counts) > 1:
        panels["outcome"] = _outcomes(members, parameter, orders, slices)
    for quantity in mapped(members):
        if not varies(quantity.values):
            continue
        if quantity.name == "peak-displacement" and len(slices) == 1:
            panels[quantity.name] = _peaks(members, parameter, orders[0])
            continue
        lines = tuple(
            _line(parameter, order, quantity.values, part.title, colour)
            for colour, (order, part) in enumerate(zip(orders, slices, strict=True))
        )
        panels[quantity.name] = Panel(parameter.axis, quantity.axis, lines)
    if not panels:
        return [f"The outcome and all quantities are constant along {parameter.axis.label}."]
    title = f"Along {parameter.axis.label}"
    first = tuple(panels.pop(key) for key in FIRST if key in panels)
    figures = {"first": first, "curves": tuple(panels.values())}
    return [Figure(f"{name}-{key}", title, own, 2) for key, own in figures.items() if own]


def _order(parameter: Parameter, chosen: Array | None) -> Array:
    numbers = np.arange(len(parameter.values)) if chosen is None else chosen
    order: Array = numbers[np.argsort(parameter.values[numbers], kind="stable")]
    return order


def _line(parameter: Parameter, order: Array, values: Array, label: str, colour: int) -> Line:
    return Line(parameter.values[order].astype(float), values[order], label, colour)


def _peaks(members: Members, parameter: Parameter, order: Array) -> Panel:
    peaks = np.abs(members.column("peak_contact_displacement"))
    lines = tuple(
        _line(parameter, order, np.where(members.completed, peak, np.nan), f"|E{axis + 1}|", axis)
        for axis, peak in enumerate(peaks.T)
    )
    return Panel(parameter.axis, Axis("largest |E1|, |E2|, |E3|", "m"), lines)


def _outcomes(
    members: Members, parameter: Parameter, orders: list[Array], slices: list[Slice]
) -> Panel:
    occurring = np.flatnonzero(members.outcome_counts)
    indices = np.searchsorted(occurring, members.outcomes).astype(float)
    words = tuple(OUTCOMES[code] for code in occurring.tolist())
    marks: list[Mark] = []
    if len(slices) == 1 and len(orders[0]) <= MAX_POINTS:
        for place, code in enumerate(occurring.tolist()):
            own = orders[0][members.outcomes[orders[0]] == code]
            x, y = parameter.values[own].astype(float), np.full(len(own), float(place))
            marks.append(Points(x, y, "", POINT_COLOURS[code], code))
        return Panel(parameter.axis, Axis("outcome", categories=words), tuple(marks))
    for colour, (order, part) in enumerate(zip(orders, slices, strict=True)):
        line = replace(_line(parameter, order, indices, part.title, colour), step=True)
        points = Points(line.x, line.y, line.label, colour, colour)
        marks.append(points if len(order) <= MAX_POINTS else line)
    return Panel(parameter.axis, Axis("outcome", categories=words), tuple(marks))
