"""The effect of each parameter of sampled members: median and quantile band along it."""

from dataclasses import replace
from functools import cached_property
from itertools import combinations
from typing import NamedTuple

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.report.model.document import Block
from rbstab.report.model.figure import Axis, Band, Figure, Line, Mark, Panel
from rbstab.report.model.words import listed
from rbstab.report.sweeps.conditions.paired_conditions import Slice
from rbstab.report.sweeps.fractions import fraction
from rbstab.report.sweeps.maps.cell_values import counted_outcome
from rbstab.report.sweeps.maps.colour_ranges import is_narrow, narrow_note
from rbstab.report.sweeps.maps.grouped import Ascending, Grouped
from rbstab.report.sweeps.maps.influence import ExplainedVariance, groups_of
from rbstab.report.sweeps.members import Members
from rbstab.report.sweeps.parameters import Parameter
from rbstab.report.sweeps.quantities import mapped, varies

MIN_MEMBERS = 100
"""Fewer members, in a condition, are too few for groups along a parameter."""

GROUP_SIZE, MIN_GROUPS = 100, 4
"""Number of members in a group if there are enough: medians of fewer would show their chance."""

MAX_PANELS = 6
"""Maximum number of parameters in a figure: those with the largest effect."""

FEW_BANDS = 2
"""So many bands are always drawn in one panel; more of them only if they are apart."""

MAX_COVERED = 0.2
"""Bands are apart if no two of them share more than this part of the narrower one, on average."""

SMALL_PANELS, IN_A_ROW = 15, 5
"""Maximum number of panels with one condition each, and of those side by side; if there are more
conditions than the first number, one parameter is shown."""

OVER_CHANCE = 3.0
"""A parameter has an effect if it explains this many times what it would by chance."""

ORDERS = (0.05, 0.5, 0.95)
"""Orders of the quantiles: the band, with the median between."""

BETWEEN, INTERVAL = "5% to 95% quantile", "95% interval of the share"
"""What a band shows, of values and of shares."""


class _Effect(NamedTuple):
    """A parameter, the share of variance that it explains, and that by chance."""

    parameter: Parameter
    ratio: float
    chance: float


def effect_figures(
    name: str, members: Members, free: list[Parameter], slices: list[Slice]
) -> list[Block]:
    """Return a figure for each quantity, with a panel for each parameter that has an effect on it.

    Args:
        name: The name of the sweep.
        members: The members.
        free: The parameters that vary within a slice.
        slices: The conditions; each has its own curves.
    """
    if len(members) // len(slices) < MIN_MEMBERS:
        return []
    everyone = np.arange(len(members))
    parts = [(p.title, everyone if p.chosen is None else p.chosen) for p in slices]
    groups = [_groups_of(p, [chosen for _, chosen in parts]) for p in free]
    blocks: list[Block] = []
    for shown in _shown(members):
        key, axis, values, is_share, note, _ = shown
        finite = np.where(np.isfinite(values), values, np.nan)
        if not is_share and is_narrow(finite, axis):
            blocks.append(f"There is no figure of effects on {narrow_note(finite, axis)}")
            continue
        explained = [ExplainedVariance(finite[chosen]) for _, chosen in parts]
        effects = [_effect(p, own, explained) for p, own in zip(free, groups, strict=True)]
        order = np.argsort([-effect.ratio for effect in effects], kind="stable").tolist()
        seen = [k for k in order if effects[k].ratio > OVER_CHANCE * effects[k].chance]
        if not seen:
            names = listed(p.axis.label for p in free)
            blocks.append(f"{axis.label}: no parameter has an effect beyond chance ({names}).")
            continue
        each = [_Values(shown, title, chosen) for title, chosen in parts]
        curves = [_curves(groups[k], each, shown.end) for k in seen[:MAX_PANELS]]
        count = len(curves[0])
        apart = count <= FEW_BANDS or not any(map(_cover, curves))
        most = MAX_PANELS if apart else max(1, SMALL_PANELS // count)
        axes = [free[k].axis for k in seen]
        panels = [
            panel
            for own, x in zip(curves[:most], axes, strict=False)
            for panel in _panels(own, x, shown, apart=apart)
        ]
        without = [free[k].axis.label for k in order if k not in seen]
        caption = f"{_caption(is_share=is_share, conditions=len(slices))} {note}".strip()
        if len(seen) > most:
            largest = "parameter with the largest effect is"
            if most > 1:
                largest = f"{most} parameters with the largest effects are"
            others = listed((axis.label for axis in axes[most:]), 12)
            caption += f" The {largest} shown. Smaller effects: {others}."
        if without:
            caption += f" Without an effect beyond chance: {listed(without, 12)}."
        title = f"Effect of each parameter on {axis.label}"
        columns = 3 if apart else -(-count // -(-count // IN_A_ROW))
        figure = Figure(f"{name}-effect-{key}", title, tuple(panels), columns, caption=caption)
        blocks.append(replace(figure, shared="y", small=not apart))
    return blocks


class _Groups:
    """The groups along a parameter of the members of a condition.

    Attributes:
        of_member: The number of the group of each member, shape (n,).
    """

    def __init__(self, parameter: Parameter, chosen: Array) -> None:
        wanted = max(MIN_GROUPS, len(chosen) // GROUP_SIZE)
        self.of_member = groups_of(parameter, chosen, wanted)
        self.of_parameter = parameter.values[chosen]

    @cached_property
    def sorted(self) -> Grouped:
        """The members in the order of their groups."""
        return Grouped(self.of_member, int(self.of_member.max()) + 1)

    @cached_property
    def places(self) -> Array:
        """The median of the parameter in each group that has members."""
        medians = self.sorted.medians(self.of_parameter)
        return medians[self.sorted.counts > 0]


def _groups_of(parameter: Parameter, conditions: list[Array]) -> list[_Groups]:
    """Return the groups along a parameter in each condition.

    In most plans all conditions have the same values of it, and so the same groups.
    """
    found: list[_Groups] = []
    for chosen in conditions:
        is_alike = found and np.array_equal(found[-1].of_parameter, parameter.values[chosen])
        found.append(found[-1] if is_alike else _Groups(parameter, chosen))
    return found


class _Shown(NamedTuple):
    """What is shown: a quantity, or the share of an outcome. note is for the caption.

    A value above `end` is drawn there.
    """

    name: str
    axis: Axis
    values: Array
    is_share: bool
    note: str = ""
    end: float = np.inf


def _shown(members: Members) -> list[_Shown]:
    found: list[_Shown] = []
    if np.count_nonzero(members.outcome_counts) > 1:
        label, fulfilled = counted_outcome(members)
        found.append(_Shown("outcome", Axis(f"share: {label}"), fulfilled.astype(float), True))
    # v(0) is a function of the parameters, and says something only beside c*.
    quantities = [q for q in mapped(members) if varies(q.values) and q.name != "start-energy"]
    found += [_Shown(q.name, q.axis, q.ranked, False, q.note, q.end) for q in quantities]
    return found


def _effect(
    parameter: Parameter, groups: list[_Groups], explained: list[ExplainedVariance]
) -> _Effect:
    """Return the effect of a parameter: that in the slice where it explains most."""
    ratios, chances = [0.0], [0.0]
    for own, variance in zip(groups, explained, strict=True):
        ratio = variance.by(own.of_member)
        ratios.append(0.0 if np.isnan(ratio) else ratio)
        chances.append(own.of_member.max() / len(own.of_member))
    return _Effect(parameter, max(ratios), max(chances))


class _Curve(NamedTuple):
    """The quantiles of a condition along a parameter; low and high are the ends of its band."""

    title: str
    colour: int
    x: Array
    low: Array
    middle: Array
    high: Array


class _Values:
    """What is shown, of the members of one condition."""

    def __init__(self, shown: _Shown, title: str, chosen: Array) -> None:
        self.title = title
        self.values = shown.values[chosen]
        self.is_share = shown.is_share
        self.is_known = not np.isnan(self.values).all()

    @cached_property
    def ascending(self) -> Ascending:
        """The values in ascending order."""
        return Ascending(self.values)

    def along(self, groups: _Groups) -> Array:
        """Return low, middle and high of the values in each group, shape (3, groups)."""
        if not self.is_share:
            return groups.sorted.quantiles(self.ascending, ORDERS)
        shares = [fraction("", own > 0) for own in groups.sorted.split(self.values)]
        return np.array([[share.low, share.value, share.high] for share in shares]).T


def _curves(groups: list[_Groups], conditions: list[_Values], end: float) -> list[_Curve]:
    """Return the curve along a parameter of each condition that has values."""
    curves = []
    for colour, (own, values) in enumerate(zip(groups, conditions, strict=True)):
        if values.is_known:
            spread = values.along(own)
            drawn = np.where(np.isinf(spread), end, spread)
            curves.append(_Curve(values.title, colour, own.places, *drawn))
    return curves


def _cover(curves: list[_Curve]) -> bool:
    """Return whether two of the bands along a parameter cover each other."""
    for one, other in combinations(curves, 2):
        # Groups of sampled values are at nearly the same places in all conditions.
        low, high = (np.interp(one.x, other.x, ends) for ends in (other.low, other.high))
        common = np.minimum(one.high, high) - np.maximum(one.low, low)
        narrower = np.minimum(one.high - one.low, high - low)
        share = np.clip(common, 0.0, None)[narrower > 0] / narrower[narrower > 0]
        if len(share) and np.nanmean(share) > MAX_COVERED:
            return True
    return False


def _panels(curves: list[_Curve], x: Axis, shown: _Shown, *, apart: bool) -> list[Panel]:
    """Return the panel of a parameter, or one for each condition if their bands are not apart."""
    word, area = ("share", INTERVAL) if shown.is_share else ("median", BETWEEN)
    bands: list[Mark] = []
    lines: list[Mark] = []
    for own in curves:
        label = f"{own.title}: {area}".removeprefix(": ") if apart else ""
        bands.append(Band(own.x, own.low, own.high, label, own.colour))
        lines.append(Line(own.x, own.middle, (own.title or word) if apart else "", own.colour))
    if apart:
        return [Panel(x, shown.axis, (*bands, *lines))]
    of_each = zip(curves, bands, lines, strict=True)
    return [Panel(x, shown.axis, (band, line), own.title) for own, band, line in of_each]


def _caption(*, is_share: bool, conditions: int) -> str:
    line, area = ("share", INTERVAL) if is_share else ("median", BETWEEN)
    where = (
        ", in the condition where it explains most (the table above has all members together)"
        if conditions > 1
        else ""
    )
    return (
        f"The members are divided into groups along each parameter; the {line} ({area}: the band) "
        f"of each is drawn. The parameter that explains most is first{where}."
    )
