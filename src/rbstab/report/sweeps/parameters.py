"""What a sweep varies, as axes of figures, and how an axis is cut into cells."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.report.model.figure import Axis
from rbstab.report.model.words import untrusted
from rbstab.store.table import Table
from rbstab.sweep.folder.layout import safe_name
from rbstab.sweep.plan.axes import VARIANT, Column
from rbstab.sweep.plan.axes import Axis as Varied
from rbstab.sweep.plan.distributions import FiniteList, Geomspace, Logspace, LogUniform
from rbstab.sweep.plan.plan import Plan
from rbstab.sweep.plan.read_vary import VARIED

MAX_CELLS = 256
"""Along an axis of a map: a page shows no more, and a file of millions is no report."""

_LOGARITHMIC = (Geomspace, Logspace, LogUniform)


@dataclass(frozen=True, eq=False)
class Parameter:
    """One axis of a plan: a varied key, or several that move together.

    Args:
        name: Of the axis in the plan.
        column: The column of the table that stands for it.
        axis: How it stands in a figure; with words, values are their places.
        values: Of every member, shape (n,).
        listed: Whether they come from a list.
    """

    name: str
    column: str
    axis: Axis
    values: Array
    listed: bool

    @cached_property
    def entries(self) -> Array:
        """The different values, ascending."""
        return np.unique(self.values)

    @property
    def unit_values(self) -> Array:
        """The values from 0 to 1 along their axis, as it is drawn, shape (n,)."""
        values = np.log(self.values) if self.axis.log else self.values.astype(float)
        low, high = values.min(), values.max()
        return (values - low) / (high - low) if high > low else np.zeros(len(values))


class Cut(NamedTuple):
    """An axis in cells: the cell of every member, the middles of the cells, what is along it.

    drawn tells whether chance decides how many members a cell has.
    """

    places: Array
    middles: Array
    axis: Axis
    drawn: bool


def parameters_of(plan: Plan, table: Table) -> tuple[Parameter, ...]:
    """The axes of a plan that have more than one value, in its order."""
    found = [_parameter(axis, table) for axis in plan.axes if axis.length != 1]
    return tuple(p for p in found if len(p.values) and p.values.min() < p.values.max())


def cut(parameter: Parameter, most: int = MAX_CELLS) -> Cut:
    """A parameter cut into cells.

    A list has a cell for each entry, or for some neighbouring ones where there are more than
    `MAX_CELLS`; what is drawn has cells that are equally wide.

    Args:
        parameter: The parameter.
        most: The most cells of what is drawn.
    """
    values, axis = parameter.values, parameter.axis
    if parameter.listed:
        entries = parameter.entries
        places = np.searchsorted(entries, values)
        together = -(-len(entries) // MAX_CELLS)
        starts = np.arange(0, len(entries), together)
        scaled = np.log(entries) if axis.log else entries.astype(float)
        sizes = np.diff([*starts, len(entries)])
        middles = np.add.reduceat(scaled, starts) / sizes
        if together == 1:
            return Cut(places, entries.astype(float), axis, drawn=False)
        middles = np.exp(middles) if axis.log else middles
        return Cut(places // together, middles, axis, drawn=False)
    scaled = np.log(values) if axis.log else values
    edges = np.linspace(scaled.min(), scaled.max(), most + 1)
    places = np.clip(np.searchsorted(edges, scaled, side="right") - 1, 0, most - 1)
    middles = (edges[1:] + edges[:-1]) / 2
    return Cut(places, np.exp(middles) if axis.log else middles, axis, drawn=True)


def _parameter(axis: Varied, table: Table) -> Parameter:
    column = _standing_for(axis, table)
    name = safe_name(column.key)
    stored, values = table.layout[name], table[name]
    listed = isinstance(column.distribution, FiniteList)
    log = isinstance(column.distribution, _LOGARITHMIC) and bool((values > 0).all())
    others = [c.key for c in axis.columns if c is not column]
    label = shortened(untrusted(stored.long_name))
    if others:
        label += f" (with {', '.join(map(shortened, others))})"
    drawn = Axis(label, stored.unit, log=log, words=stored.flags)
    return Parameter(axis.name, name, drawn, values, listed)


def shortened(label: str) -> str:
    """The name of a column without the section of its key, which the rest of it tells."""
    for section in VARIED:
        label = label.replace(f"{section}.", "initial " if section == "initial" else "")
    return label


def _standing_for(axis: Varied, table: Table) -> Column:
    """The column by which an axis is drawn: the variant, or the one with the most values."""
    for column in axis.columns:
        if column.path == VARIANT:
            return column
    if len(axis.columns) == 1:
        return axis.columns[0]
    return max(axis.columns, key=lambda c: len(np.unique(table[safe_name(c.key)])))
