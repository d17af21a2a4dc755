"""Which figures show what depends on parameters: maps over two, curves along one, effects."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rbstab.report.model.document import Block
from rbstab.report.model.figure import Figure
from rbstab.report.sweeps.conditions.paired_conditions import (
    Slice,
    paired_conditions_of,
    slices_of,
)
from rbstab.report.sweeps.maps.effects import Effects
from rbstab.report.sweeps.maps.figures import Mapped, curves, map_figures, point_figure
from rbstab.report.sweeps.members import Members
from rbstab.report.sweeps.parameters import Parameter, binned

MAX_SLICES = 6
"""Maximum number of slices along a third axis."""

MEMBERS_PER_CELL = 20
"""Average number of members in a cell of sampled values."""

MAX_SAMPLED_CELLS = 100
"""Maximum number of cells along an axis of sampled values."""

MIN_SAMPLED_FOR_MAPS = 320
"""Fewer sampled members are drawn as points; a map would have too few cells."""


class OverParameters(NamedTuple):
    """What depends on parameters.

    Attributes:
        maps: At most two maps, or figures of curves; the first shows what became of the members, if
            they differ in it.
        effects: The effect of each parameter of drawn members.
    """

    maps: list[Figure]
    effects: list[Block]


def over_parameters(name: str, members: Members, command: str = "") -> OverParameters:
    """Return maps over two parameters and the effects of parameters, or curves along one.

    Args:
        name: The name of the sweep; the names of the figures begin with it.
        members: The members.
        command: The command that runs a member, without its number.
    """
    groups = paired_conditions_of(members)
    compared = groups.parameters if groups is not None else ()
    free = [p for p in members.parameters if p not in compared]
    if not free:
        return OverParameters([], [])
    slices = slices_of(members)
    what, effects = Mapped(name, members, slices), list[Block]()
    if len(free) == 1:
        maps = curves(what, free[0])
    elif members.is_drawn:
        found = Effects(members, free, slices)
        maps, effects = _sample_maps(what, found.order), found.blocks(name)
    else:
        maps = _grid_maps(what, free)
    maps = [replace(figure, command=command) for figure in maps]
    return OverParameters(maps, effects)


def _grid_maps(what: Mapped, free: list[Parameter]) -> list[Figure]:
    """Return maps over the two longest axes of a grid, with slices along a third axis."""
    longest = sorted(free, key=lambda p: -len(p.entries))
    first, second = (p for p in free if p in longest[:2])
    others, notes = longest[2:], []
    if others and len(what.slices) == 1:
        what = what._replace(slices=_slices_along(others[0]))
        notes.append(f"Slices at selected values of {others[0].axis.label}.")
        others = others[1:]
    if others:
        names = ", ".join(p.axis.label for p in others)
        notes.append(f"A cell has the share or the median of its members over all {names}.")
    return map_figures(what, (binned(first), binned(second)), " ".join(notes), most=2)


def _sample_maps(what: Mapped, order: list[Parameter]) -> list[Figure]:
    """Return maps over the first two parameters; of few members of one condition, points."""
    count = len(what.members) // len(what.slices)
    if count >= MIN_SAMPLED_FOR_MAPS:
        cells = int(np.clip(np.sqrt(count / MEMBERS_PER_CELL), 2, MAX_SAMPLED_CELLS))
        axes = binned(order[0], cells), binned(order[1], cells)
        caption = "Over the two parameters that explain most; a cell has some 20 members or more."
        return map_figures(what, axes, caption, most=1)
    if len(what.slices) == 1 and np.count_nonzero(what.members.outcome_counts) > 1:
        return [point_figure(what, (order[0], order[1]))]
    return []


def _slices_along(parameter: Parameter) -> list[Slice]:
    entries = parameter.entries
    picked = np.unique(np.linspace(0, len(entries) - 1, MAX_SLICES).round().astype(int))
    return [
        Slice(f"{parameter.axis.label} = {entry:.4g}", np.flatnonzero(parameter.values == entry))
        for entry in entries[picked].tolist()
    ]
