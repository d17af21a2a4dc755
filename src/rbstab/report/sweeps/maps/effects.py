"""The effect of each parameter of sampled members: what it explains, and curves along it."""

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.report.model.document import Block, Cell, Table
from rbstab.report.model.figure import Band, Figure, Line, Mark, Panel
from rbstab.report.sweeps.conditions.paired_conditions import Slice
from rbstab.report.sweeps.maps.shown import FIRST, shown_of
from rbstab.report.sweeps.members import Members
from rbstab.report.sweeps.outcomes import wilson
from rbstab.report.sweeps.parameters import Parameter
from rbstab.report.sweeps.quantiles import Ascending, quantiles_by_group
from rbstab.report.sweeps.quantities import MemberQuantity

MIN_MEMBERS = 100
"""Fewer members, in a condition, are too few for groups along a parameter."""

GROUP_SIZE, CURVE_GROUP_SIZE = 25, 100
"""Members in a group for what a parameter explains, and for a curve: medians of fewer would show
their chance.
"""

MIN_GROUPS, MAX_GROUPS = 4, 20
"""The numbers of groups."""

MAX_PANELS = 6
"""Maximum number of parameters in a figure: those that explain most."""

OVER_CHANCE = 3.0
"""A parameter has an effect if it explains this many times what it would by chance."""

ORDERS = (0.05, 0.5, 0.95)
"""Orders of the quantiles: the band, with the median between."""

NOTE = (
    "The share of the variance that one parameter alone explains: 0 is none, 1 is all (correlation "
    "ratio η², which estimates Sobol's first-order index if the parameters are sampled "
    "independently); the largest of all conditions. A parameter without any effect has about "
    "{chance:.2g} here, by chance: the number of groups over the number of members."
)


class Effects:
    """What each parameter explains of each quantity.

    Args:
        members: The members.
        free: The parameters that vary within a slice; p of them.
        slices: The conditions; the one in which a parameter explains most counts.

    Attributes:
        order: The parameters, that which explains most of all quantities first.
        ratios: The shares that they explain, in this order, shape (p, quantities).
    """

    def __init__(self, members: Members, free: list[Parameter], slices: list[Slice]) -> None:
        self._slices = slices
        self._shown = [q for quantity in shown_of(members) if (q := quantity.of_several).varies]
        # What a parameter without any effect explains.
        self._chance = 0.0
        # What is not known explains nothing.
        ratios = np.zeros((len(free), len(self._shown)))
        for parameter, row in zip(free, ratios, strict=True):
            for part in slices:
                groups = groups_of(parameter, part.chosen, GROUP_SIZE)
                self._chance = max(self._chance, groups.max() / len(groups))
                shares = [explained(q.values[part.chosen], groups) for q in self._shown]
                np.fmax(row, shares, out=row)
        order = np.argsort(-ratios.sum(axis=1), kind="stable")
        self.order, self.ratios = [free[k] for k in order.tolist()], ratios[order]

    def blocks(self, name: str) -> list[Block]:
        """Return a figure of the first quantity that a parameter has an effect on, and a table.

        Nothing is said of few members.
        """
        if not self._shown or min(len(part.chosen) for part in self._slices) < MIN_MEMBERS:
            return []
        heads = "parameter", *(q.axis.label for q in self._shown)
        rows = [
            (parameter.axis.label, *(Cell.number(ratio, 2) for ratio in row.round(12)))
            for parameter, row in zip(self.order, self.ratios, strict=True)
        ]
        note, title = NOTE.format(chance=self._chance), "What each parameter explains"
        table = Table.of(f"{name}-influence", title, heads, rows, note)
        for column, quantity in enumerate(self._shown):
            ratios = self.ratios[:, column]
            order = np.argsort(-ratios, kind="stable").tolist()
            seen = [k for k in order if ratios[k] > OVER_CHANCE * self._chance]
            if seen and quantity.name not in FIRST[1:]:
                return [self._figure(name, quantity, seen[:MAX_PANELS], ratios), table]
        return [table]

    def _figure(
        self, name: str, quantity: MemberQuantity, seen: list[int], ratios: Array
    ) -> Figure:
        """Return a panel along each parameter that is seen to have an effect."""
        ascending = [Ascending(quantity.ranked[part.chosen]) for part in self._slices]
        panels = []
        for k in seen:
            marks: list[Mark] = []
            for colour, part in enumerate(self._slices):
                groups = groups_of(self.order[k], part.chosen, CURVE_GROUP_SIZE)
                size = int(groups.max()) + 1
                places = Ascending(self.order[k].values[part.chosen])
                (x,) = quantiles_by_group(groups, size, places, (0.5,))
                if quantity.is_share:
                    counts = np.bincount(groups, quantity.values[part.chosen], size)
                    middle, low, high = wilson(counts, np.bincount(groups, minlength=size))
                else:
                    quantiles = quantiles_by_group(groups, size, ascending[colour], ORDERS)
                    low, middle, high = np.where(np.isinf(quantiles), quantity.end, quantiles)
                if len(self._slices) == 1:
                    marks.append(Band(x, low, high))
                marks.append(Line(x, middle, part.title, colour))
            title = f"explains {ratios[k]:.0%}"
            panels.append(Panel(self.order[k].axis, quantity.axis, tuple(marks), title))
        what = "Share (95% interval" if quantity.is_share else "Median (5% to 95% quantile"
        what = f"{what}: the band)" if len(self._slices) == 1 else what.partition(" ")[0]
        caption = f"{what} of groups along each parameter. {quantity.note}".strip()
        title, key = f"Effect on {quantity.axis.label}", f"{name}-effect-{quantity.name}"
        return Figure(key, title, tuple(panels), 3, caption=caption, shared="y")


def explained(values: Array, groups: Array) -> float:
    """Return the variance of group means over the total variance (correlation ratio η²).

    Args:
        values: Only finite ones count, shape (n,).
        groups: The group of each value, integers from 0, shape (n,).

    Returns:
        A ratio between 0 and 1; NaN if the values do not vary.
    """
    finite = np.isfinite(values)
    values, groups = values[finite], groups[finite]
    if not len(values) or np.ptp(values) <= 1e-9 * np.abs(values).max():
        return float("nan")
    # Scaled to at most 1, so that squares do not overflow.
    values = values / np.abs(values).max()
    deviations = values - values.mean()
    counts = np.bincount(groups)
    sums = np.bincount(groups, weights=deviations)
    between = float((sums[counts > 0] ** 2 / counts[counts > 0]).sum())
    return between / float(deviations @ deviations)


def groups_of(parameter: Parameter, chosen: Array, members: int) -> Array:
    """Return the group of each chosen member: one entry of a short list, or a range of values.

    Args:
        parameter: The parameter.
        chosen: The numbers of the members, shape (n,).
        members: The number of members in a range, if that makes `MIN_GROUPS` to `MAX_GROUPS`.
    """
    values = parameter.values[chosen]
    if parameter.listed and len(parameter.entries) <= MAX_GROUPS:
        return np.searchsorted(parameter.entries, values)
    count = int(np.clip(len(values) // members, MIN_GROUPS, MAX_GROUPS))
    edges = np.quantile(values, np.linspace(0, 1, count + 1)[1:-1])
    return np.searchsorted(edges, values, side="right")
