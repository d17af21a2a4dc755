"""Maps of a sweep over two parameters, or curves along one."""

from dataclasses import replace

import numpy as np

from rbstab.report.model.document import Block
from rbstab.report.model.figure import Figure
from rbstab.report.sweeps.conditions.paired_conditions import Slice, paired_conditions_of
from rbstab.report.sweeps.maps.cell_grid import map_grid
from rbstab.report.sweeps.maps.curves import curves
from rbstab.report.sweeps.maps.effects import effect_figures
from rbstab.report.sweeps.maps.explained import MIN_EXPLAINED, explained_by_cells
from rbstab.report.sweeps.maps.figures import Mapped, map_figures, scatter_figure
from rbstab.report.sweeps.maps.influence import Influence
from rbstab.report.sweeps.members import OUTCOMES, Members
from rbstab.report.sweeps.parameters import Parameter, binned

MAX_SLICES = 6
"""Maximum number of slices along a third axis."""

MEMBERS_PER_CELL = 20
"""Average number of members in a cell of sampled values."""

MAX_SAMPLED_CELLS = 100
"""Maximum number of cells along an axis of sampled values."""

START_ENERGY = "start-energy"
"""v(0) has no maps by condition: each condition has its own v, so that colours mean nothing."""

MIN_SAMPLED_FOR_MAPS = 320
"""Fewer sampled members are drawn as points; a map would have too few cells."""


def map_blocks(name: str, members: Members, command: str = "") -> list[Block]:
    """Return maps over two parameters and the effects of parameters, or curves along one.

    Args:
        name: The name of the sweep; the names of the figures begin with it.
        members: The members.
        command: The command that runs a member, without its number.
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
    plan, what = members.plan, Mapped(name, members, slices)
    is_grid = plan is not None and plan.design is None
    blocks = _grid_maps(what, free) if is_grid else _sample_maps(what, free)
    return [replace(b, command=command) if isinstance(b, Figure) else b for b in blocks]


def _grid_maps(what: Mapped, free: list[Parameter]) -> list[Block]:
    """Return maps over the two longest axes of a grid, with slices along a third axis."""
    name, members, slices = what
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
    left_out = (START_ENERGY,) if len(what.slices) > 1 else ()
    figures = map_figures(Mapped(name, members, slices), axes, caption.strip(), left_out=left_out)
    return [*_single_outcome(members), *figures]


def _sample_maps(what: Mapped, free: list[Parameter]) -> list[Block]:
    """Return the table of influence, the effects, and maps over the most influential parameters."""
    name, members, slices = what
    influence = Influence(members)
    first, second = [p for k in influence.order if (p := influence.parameters[k]) in free][:2]
    blocks: list[Block] = [
        influence.table(f"{name}-influence"),
        *effect_figures(name, members, free, slices),
        *_single_outcome(members),
    ]
    caption = "The axes are the two parameters that explain most of the variance of all quantities."
    if len(members) // len(slices) < MIN_SAMPLED_FOR_MAPS:
        if np.count_nonzero(members.outcome_counts) > 1:
            blocks.append(scatter_figure(what, (first, second), caption))
        return blocks
    count = sampled_cell_count(len(members) // len(slices))
    caption += (
        " Each cell shows the share or the median of its members, on average about "
        f"{MEMBERS_PER_CELL} or more."
    )
    cells = (binned(first, count), binned(second, count))
    explained = explained_by_cells(members, [map_grid(*cells, part.chosen) for part in slices])
    few = {n: found for n, found in explained.items() if not found[1] >= MIN_EXPLAINED}
    # A share that is the same in all members has no map, and nothing to explain.
    spread = {n: found for n, found in few.items() if not np.isnan(found[1])}
    if spread:
        blocks.append(_left_out((first, second), spread))
    left_out = {*few, *((START_ENERGY,) if len(slices) > 1 else ())}
    return blocks + map_figures(what, cells, caption, left_out=left_out)


def _left_out(over: tuple[Parameter, Parameter], few: dict[str, tuple[str, float]]) -> str:
    """Return a sentence on the maps that would say little."""
    what = "; ".join(f"{label} ({share:.0%})" for label, share in few.values())
    axes = " and ".join(p.axis.label for p in over)
    return (
        f"A map over {axes} is left out where its cells explain less than {MIN_EXPLAINED:.0%} of "
        "the variance, because the members of one cell then differ by more than the cells do. "
        f"Explained: {what}."
    )


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
