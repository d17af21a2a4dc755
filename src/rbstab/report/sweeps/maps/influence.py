"""Influence of each parameter on the outcomes of a sweep."""

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.report.model.document import Cell, Head, Table
from rbstab.report.sweeps.members import RETURNS, Members
from rbstab.report.sweeps.parameters import Parameter
from rbstab.report.sweeps.quantities import mapped, varies
from rbstab.report.sweeps.table_entries import number

BINS = 20
"""Maximum number of groups into which the members are divided by the values of a parameter."""

MIN_GROUP_SIZE = 25
"""Smallest average size of a group of sampled values; with fewer, chance looks like influence."""

MAX_FOR_EDGES = 100_000
"""Of more members, so many are drawn to find the ranges: these need not be of equal size."""

ROUND_OFF = 1e-12
"""A ratio below this is round-off of sums of squares that are at most 1."""

NOTE = (
    "How much of the variance of a quantity is explained by one parameter alone: 0 is none, 1 is "
    "all (correlation ratio η², which estimates Sobol's first-order index if the parameters are "
    "sampled independently). The members are divided into groups by the values of the parameter, "
    "and the variance of the groups' means is divided by that of all members. A parameter without "
    "any influence has about {chance:.2g} here, by chance: the number of groups over the number "
    "of members."
)


class Influence:
    """Correlation ratios of a sweep.

    Attributes:
        labels: The labels of the quantities.
        ratios: The ratio of each parameter (row) and quantity (column), shape (p, q).
    """

    def __init__(self, members: Members) -> None:
        self.parameters = members.parameters
        quantities: dict[str, Array] = {}
        returns = members.outcomes == RETURNS
        if returns.any() and not returns.all():
            quantities["returns or not"] = returns.astype(float)
        for quantity in mapped(members):
            if varies(quantity.values):
                quantities[quantity.axis.label] = quantity.values
        self.labels = tuple(quantities)
        self.groups = [groups_of(p, np.arange(len(members))) for p in self.parameters]
        explained = [ExplainedVariance(y) for y in quantities.values()]
        rows = [[one.by(g) for one in explained] for g in self.groups]
        self.ratios = np.array(rows).reshape(len(rows), len(quantities))

    @property
    def order(self) -> list[int]:
        """The indices of the parameters, sorted by the sum of their ratios, the largest first."""
        return np.argsort(-np.nansum(self.ratios, axis=1), kind="stable").tolist()

    def table(self, name: str) -> Table:
        """Return the ratios as a table, with the most influential parameter first."""
        heads = (Head("parameter"), *(Head(label, numbers=True) for label in self.labels))
        rows = tuple(
            (Cell(self.parameters[k].axis.label), *(_ratio(r) for r in self.ratios[k].tolist()))
            for k in self.order
        )
        size = len(self.parameters[0].values)
        chance = max(int(g.max()) for g in self.groups) / size
        title = "Influence of the parameters: explained share of the variance"
        return Table(name, title, heads, rows, NOTE.format(chance=chance))


def _ratio(value: float) -> Cell:
    """Return a cell with a ratio; one that is round-off is 0."""
    return number(0.0 if value < ROUND_OFF else value, 2)


class ExplainedVariance:
    """The share of the variance of some values that groups explain; only finite values count.

    Args:
        values: Shape (n,).
    """

    def __init__(self, values: Array) -> None:
        self._finite = np.isfinite(values)
        self._deviations: Array | None = None
        values = values[self._finite]
        if varies(values):
            # Scaled to at most 1, so that squares do not overflow.
            values = values / np.abs(values).max()
            self._deviations = values - values.mean()
            self._total = float(self._deviations @ self._deviations)

    def by(self, groups: Array) -> float:
        """Return the variance of group means over the total variance (correlation ratio η²).

        Args:
            groups: The group of each value, integers from 0, shape (n,).

        Returns:
            A ratio between 0 and 1; NaN if the values do not vary.
        """
        if self._deviations is None:
            return float("nan")
        groups = groups[self._finite]
        counts = np.bincount(groups)
        sums = np.bincount(groups, weights=self._deviations)
        between = float((sums[counts > 0] ** 2 / counts[counts > 0]).sum())
        return between / self._total


def groups_of(parameter: Parameter, chosen: Array, groups: int | None = None) -> Array:
    """Return the number of the group of each chosen member along a parameter.

    A group is one entry of a short list, or a range between quantiles.

    Args:
        parameter: The parameter.
        chosen: The numbers of the members, shape (n,).
        groups: The number of ranges of sampled values, at most `BINS`; None: as many as have
            `MIN_GROUP_SIZE` members.
    """
    values = parameter.values[chosen]
    if parameter.listed and len(parameter.entries) <= BINS:
        return np.searchsorted(parameter.entries, values)
    bins = max(2, min(BINS, groups or len(values) // MIN_GROUP_SIZE))
    typical = values
    if len(values) > MAX_FOR_EDGES:
        typical = values[np.random.default_rng(0).integers(0, len(values), MAX_FOR_EDGES)]
    edges = np.quantile(typical, np.linspace(0, 1, bins + 1)[1:-1])
    return np.searchsorted(edges, values, side="right")
