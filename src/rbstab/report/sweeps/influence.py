"""On which of its parameters the outcome of a sweep depends most."""

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.report.model.document import Cell, Head, Table
from rbstab.report.sweeps.members import ENDS, SETTLED, Members
from rbstab.report.sweeps.parameters import Parameter
from rbstab.report.sweeps.quantities import mapped, varies
from rbstab.report.sweeps.table_entries import number

BINS = 20
"""Groups, of about equally many members, into which a parameter is cut."""

MIN_GROUP = 25
"""Members of a group: with fewer, chance looks like influence."""

NOTE = (
    "The correlation ratio η²: the part of the variance of a quantity that the parameter alone "
    "explains, cut into groups of equally many members; 0: nothing, 1: all of it. For parameters "
    "that are drawn independently it is Sobol's index of first order. Chance alone makes about "
    "{chance:.2g} here, the number of groups over that of members."
)


class Influence:
    """The correlation ratios of a sweep.

    Attributes:
        labels: The quantities.
        ratios: Of each parameter (rows) and quantity, shape (p, q).
    """

    def __init__(self, members: Members) -> None:
        self.parameters = members.parameters
        found: dict[str, Array] = {}
        settled = members.ends == ENDS.index(SETTLED)
        if settled.any() and not settled.all():
            found["settled or not"] = settled.astype(float)
        for quantity in mapped(members):
            if varies(quantity.values):
                found[quantity.axis.label] = quantity.values
        self.labels = tuple(found)
        self.groups = [_groups(p) for p in self.parameters]
        rows = [[correlation_ratio(g, y) for y in found.values()] for g in self.groups]
        self.ratios = np.array(rows).reshape(len(rows), len(found))

    @property
    def order(self) -> list[int]:
        """The numbers of the parameters, the one with the largest sum of ratios first."""
        return np.argsort(-np.nansum(self.ratios, axis=1), kind="stable").tolist()

    def table(self, name: str) -> Table:
        """The ratios as a table, the most influential parameter first."""
        heads = (Head("parameter"), *(Head(label, numbers=True) for label in self.labels))
        rows = tuple(
            (Cell(self.parameters[k].axis.label), *(number(r, 2) for r in self.ratios[k].tolist()))
            for k in self.order
        )
        size = len(self.parameters[0].values)
        chance = max(int(g.max()) for g in self.groups) / size
        title = "What the outcome depends on"
        return Table(name, title, heads, rows, NOTE.format(chance=chance))


def correlation_ratio(groups: Array, values: Array) -> float:
    """The variance of the means of groups over the whole variance, of the finite values.

    Args:
        groups: The group of each value, whole numbers from 0, shape (n,).
        values: Shape (n,).

    Returns:
        Between 0 and 1; NaN where the values do not vary.
    """
    finite = np.isfinite(values)
    groups, values = groups[finite], values[finite]
    if not varies(values):
        return float("nan")
    # No square of a number below 1 overflows.
    values = values / np.abs(values).max()
    deviations = values - values.mean()
    counts = np.bincount(groups)
    sums = np.bincount(groups, weights=deviations)
    between = float((sums[counts > 0] ** 2 / counts[counts > 0]).sum())
    return between / float((deviations**2).sum())


def _groups(parameter: Parameter) -> Array:
    """The group of each member: an entry of a short list, or a range of equally many members."""
    values = parameter.values
    if parameter.listed and len(parameter.entries) <= BINS:
        return np.searchsorted(parameter.entries, values)
    bins = max(2, min(BINS, len(values) // MIN_GROUP))
    edges = np.quantile(values, np.linspace(0, 1, bins + 1)[1:-1])
    return np.searchsorted(edges, values, side="right")
