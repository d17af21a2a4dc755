"""Maps of a sweep over two parameters, or curves along one."""

import numpy as np

from rbstab.report.model.document import Block
from rbstab.report.sweeps.conditions.paired_conditions import Slice, paired_conditions_of
from rbstab.report.sweeps.influence import Influence
from rbstab.report.sweeps.maps.cell_values import MIN_MEMBERS
from rbstab.report.sweeps.maps.curves import curves
from rbstab.report.sweeps.maps.figures import map_figures, scatter_figure
from rbstab.report.sweeps.members import OUTCOMES, Members
from rbstab.report.sweeps.parameters import Parameter, binned

MAX_SLICES = 6
"""Maximum number of slices along a third axis."""

MEMBERS_PER_CELL = 20
"""Average number of members in a cell of sampled values."""

MAX_SAMPLED_CELLS = 100
"""Maximum number of cells along an axis of sampled values."""

MIN_SAMPLED_FOR_MAPS = 320
"""Fewer sampled members are drawn as points; a map would have too few cells."""


def map_blocks(name: str, members: Members) -> list[Block]:
    """Return maps over two parameters, or curves along one.

    Args:
        name: The name of the sweep; the names of the figures begin with it.
        members: The members.
    """
    groups = paired_conditions_of(members)
    compared = groups.parameters if groups is not None else ()
    free = [p for p in members.parameters if p not in compared]
    slices = [Slice("", None)]
    if groups is not None and free:
        slices = [
            Slice(label, np.flatnonzero(groups.codes == code))
            for code, label in enumerate(groups.labels)
        ]
    if not free:
        return []
    if len(free) == 1:
        return curves(name, members, free[0], slices)
    plan = members.plan
    if plan is not None and plan.design is None:
        return _grid_maps(name, members, free, slices)
    return _sample_maps(name, members, free, slices)


def _grid_maps(
    name: str, members: Members, free: list[Parameter], slices: list[Slice]
) -> list[Block]:
    """Return maps over the two longest axes of a grid, with slices along a third axis."""
    longest = sorted(free, key=lambda p: -len(p.entries))
    first, second = (p for p in free if p in longest[:2])
    others = longest[2:]
    caption = ""
    if others and len(slices) == 1:
        slices = _slices_along(others[0])
        caption = f"The maps are slices at selected values of {others[0].axis.label}."
        others = others[1:]
    if others:
        names = ", ".join(p.axis.label for p in others)
        caption += (
            f" Each cell shows the share or the median of its members over all values of {names}."
        )
    axes = (binned(first), binned(second))
    figures = map_figures(name, members, axes, slices, caption.strip())
    return [*_single_outcome(members), *figures]


def _sample_maps(
    name: str, members: Members, free: list[Parameter], slices: list[Slice]
) -> list[Block]:
    """Return the table of influence, and maps over the two most influential parameters."""
    influence = Influence(members)
    first, second = [p for k in influence.order if (p := influence.parameters[k]) in free][:2]
    blocks: list[Block] = [influence.table(f"{name}-influence"), *_single_outcome(members)]
    caption = "The axes are the two parameters with the largest sums of correlation ratios."
    if len(members) // len(slices) < MIN_SAMPLED_FOR_MAPS:
        if np.count_nonzero(members.outcome_counts) > 1:
            blocks.append(scatter_figure(name, members, (first, second), slices, caption))
        return blocks
    count = sampled_cell_count(len(members) // len(slices))
    caption += (
        " Each cell shows the share or the median of its members, on average about "
        f"{MEMBERS_PER_CELL} or more. A cell with fewer than {MIN_MEMBERS} members is empty."
    )
    axes = (binned(first, count), binned(second, count))
    return blocks + map_figures(name, members, axes, slices, caption)


def _single_outcome(members: Members) -> list[Block]:
    """Return a sentence in place of the map of outcomes if there is only one outcome."""
    if np.count_nonzero(members.outcome_counts) > 1:
        return []
    outcome = OUTCOMES[int(members.outcome_counts.argmax())]
    return [f"All members have the same outcome ({outcome}), so there is no map of outcomes."]


def sampled_cell_count(members: int) -> int:
    """Return the number of cells along an axis of sampled values for a number of members."""
    return int(np.clip(np.sqrt(members / MEMBERS_PER_CELL), 2, MAX_SAMPLED_CELLS))


def _slices_along(parameter: Parameter) -> list[Slice]:
    entries = parameter.entries
    picked = np.unique(np.linspace(0, len(entries) - 1, MAX_SLICES).round().astype(int))
    return [
        Slice(f"{parameter.axis.label} = {entry:.4g}", np.flatnonzero(parameter.values == entry))
        for entry in entries[picked].tolist()
    ]
