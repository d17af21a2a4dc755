"""The parameters of a sweep as axes of figures, and their division into cells."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.report.model.figure import Axis
from rbstab.report.model.words import untrusted
from rbstab.store.table import Table
from rbstab.store.variables import safe_name
from rbstab.sweep.folder.deciding import shown_number
from rbstab.sweep.plan.axes import VARIANT, VARIED_SECTIONS, VariedKey
from rbstab.sweep.plan.axes import Axis as PlanAxis
from rbstab.sweep.plan.distributions import FiniteList, Geomspace, Logspace, LogUniform
from rbstab.sweep.plan.plan import Plan

MAX_CELLS = 256
"""Maximum number of cells along an axis of a map; more are invisible and make the report large."""

_LOGARITHMIC = (Geomspace, Logspace, LogUniform)


@dataclass(frozen=True, eq=False)
class Parameter:
    """One axis of a plan: a varied key, or several that move together.

    Args:
        name: The name of the axis in the plan.
        axis: Its axis in a figure; if the axis has categories, values are indices of categories.
        values: The value of each member, shape (n,).
        listed: Whether the values come from a list.
    """

    name: str
    axis: Axis
    values: Array
    listed: bool

    @cached_property
    def entries(self) -> Array:
        """The distinct values, ascending."""
        return np.unique(self.values)


class BinnedAxis(NamedTuple):
    """An axis divided into cells.

    indices are the cells of the members, shape (n,); middles are the middles of the cells. sampled
    is True if the values were sampled; the number of members in a cell is then random.
    """

    indices: Array
    middles: Array
    axis: Axis
    sampled: bool


def parameters_of(plan: Plan, table: Table) -> tuple[Parameter, ...]:
    """Return the axes of a plan with more than one value, in the order of the plan.

    A number that counts the members, as the seed of a noise, says nothing about them.
    """
    axes = [axis for axis in plan.axes if axis.length != 1 and not axis.counts_members]
    parameters = [_parameter(plan, axis, table) for axis in axes]
    return tuple(p for p in parameters if len(p.values) and p.values.min() < p.values.max())


def binned(parameter: Parameter, cell_count: int = MAX_CELLS) -> BinnedAxis:
    """Divide a parameter into cells: one for each entry of a list, or of equal width.

    Args:
        parameter: The parameter. With more than `MAX_CELLS` entries, neighbours share a cell.
        cell_count: The number of cells for sampled values.
    """
    values, axis, is_sampled = parameter.values, parameter.axis, not parameter.listed
    if parameter.listed:
        entries = parameter.entries
        per_cell = -(-len(entries) // MAX_CELLS)
        if per_cell == 1:
            indices = np.searchsorted(entries, values)
            return BinnedAxis(indices, entries.astype(float), axis, is_sampled)
        cell_count = -(-len(entries) // per_cell)
    scaled = np.log(values) if axis.log else values
    edges = np.linspace(scaled.min(), scaled.max(), cell_count + 1)
    indices = np.clip(np.searchsorted(edges, scaled, side="right") - 1, 0, cell_count - 1)
    middles = (edges[1:] + edges[:-1]) / 2
    return BinnedAxis(indices, np.exp(middles) if axis.log else middles, axis, is_sampled)


def _parameter(plan: Plan, axis: PlanAxis, table: Table) -> Parameter:
    """Return an axis of a plan; of factors, it shows the first number that they scale."""
    column = _representative(axis, table)
    name = safe_name(column.key)
    stored, values = table.variables[name], table[name]
    label, unit = shortened(untrusted(stored.long_name)), stored.unit
    if column.scale:
        number = shown_number(plan, column, table)
        values, unit = number.value * values, number.unit
        label = untrusted(number.name)
        key = shortened(untrusted(column.key))
        label += "" if label == key else f" (with all of {key})"
    listed = isinstance(column.distribution, FiniteList)
    log = isinstance(column.distribution, _LOGARITHMIC) and bool((values > 0).all())
    others = [c.key for c in axis.varied_keys if c is not column]
    if others:
        label += f" (with {', '.join(map(shortened, others))})"
    whole = values.dtype.kind in "iu" and not stored.flags
    figure_axis = Axis(label, unit, log=log, categories=stored.flags, whole=whole)
    return Parameter(axis.name, figure_axis, values, listed)


def shortened(label: str) -> str:
    """Return the label of a column without the section of its key."""
    for section in VARIED_SECTIONS:
        label = label.replace(f"{section}.", "initial " if section == "initial" else "")
    return label


def _representative(axis: PlanAxis, table: Table) -> VariedKey:
    """Return the column that represents an axis: the variant, or the one with the most values."""
    for column in axis.varied_keys:
        if column.path == VARIANT:
            return column
    if len(axis.varied_keys) == 1:
        return axis.varied_keys[0]
    return max(axis.varied_keys, key=lambda c: len(np.unique(table[safe_name(c.key)])))
