"""Curves of what becomes of members along the one parameter that varies."""

from dataclasses import replace

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.report.model.document import Block
from rbstab.report.model.figure import Axis, Figure, Line, Mark, Panel, Points
from rbstab.report.sweeps.members import ENDS, Members
from rbstab.report.sweeps.paired_conditions import Slice
from rbstab.report.sweeps.parameters import Parameter
from rbstab.report.sweeps.quantities import mapped, varies

AXES = ("first axis", "second axis", "third axis")

MAX_POINTS = 500
"""Members whose outcomes are drawn one by one."""


def curves(name: str, members: Members, parameter: Parameter, slices: list[Slice]) -> list[Block]:
    """Each quantity along one parameter; a curve for each slice.

    Args:
        name: Of the sweep.
        members: The members.
        parameter: What is along the horizontal axis.
        slices: What the curves are; a single one is drawn by axis where E has three.
    """
    orders = [_order(parameter, part.chosen) for part in slices]
    panels = []
    if np.count_nonzero(members.counts) > 1:
        panels.append(_ends(members, parameter, orders, slices))
    for quantity in mapped(members):
        if not varies(quantity.values):
            continue
        if quantity.name == "peak-displacement" and len(slices) == 1:
            panels.append(_peaks(members, parameter, orders[0]))
            continue
        lines = tuple(
            _line(parameter, order, quantity.values, part.title, colour)
            for colour, (order, part) in enumerate(zip(orders, slices, strict=True))
        )
        panels.append(Panel(parameter.axis, quantity.axis, lines))
    if not panels:
        return [f"Nothing varies along {parameter.axis.label}: all members are alike."]
    title = f"Along {parameter.axis.label}"
    return [Figure(f"{name}-curves", title, tuple(panels), 2)]


def _order(parameter: Parameter, chosen: Array | None) -> Array:
    numbers = np.arange(len(parameter.values)) if chosen is None else chosen
    found: Array = numbers[np.argsort(parameter.values[numbers], kind="stable")]
    return found


def _line(parameter: Parameter, order: Array, values: Array, label: str, colour: int) -> Line:
    return Line(parameter.values[order].astype(float), values[order], label, colour)


def _peaks(members: Members, parameter: Parameter, order: Array) -> Panel:
    peaks = np.where(
        members.completed[:, np.newaxis], members.column("peak_contact_displacement"), np.nan
    )
    lines = tuple(
        _line(parameter, order, peaks[:, axis], f"peak of E, {label}", axis)
        for axis, label in enumerate(AXES)
    )
    return Panel(parameter.axis, Axis("peak of E by axis", "m"), lines)


def _ends(
    members: Members, parameter: Parameter, orders: list[Array], slices: list[Slice]
) -> Panel:
    occurring = np.flatnonzero(members.counts)
    places = np.searchsorted(occurring, members.ends).astype(float)
    words = tuple(ENDS[code] for code in occurring.tolist())
    marks: list[Mark] = []
    for colour, (order, part) in enumerate(zip(orders, slices, strict=True)):
        line = replace(_line(parameter, order, places, part.title, colour), step=True)
        alone = Points(line.x, line.y, line.label, colour, colour)
        marks.append(alone if len(order) <= MAX_POINTS else line)
    return Panel(parameter.axis, Axis("outcome", words=words), tuple(marks))
