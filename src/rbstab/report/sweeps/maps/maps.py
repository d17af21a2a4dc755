"""Figures over parameters: maps over two, curves along one, points of few drawn members."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rbstab.experiment.answers.rounded import number
from rbstab.mechanics.numbers import Array
from rbstab.report.model.document import Block
from rbstab.report.model.figure import Figure, Line, Mark, Panel, Points
from rbstab.report.sweeps.conditions.paired_conditions import Slice, conditions_of
from rbstab.report.sweeps.maps.cells import MIN_MEMBERS, MapGrid, cells_of, map_grid
from rbstab.report.sweeps.maps.effects import Effects, explained
from rbstab.report.sweeps.maps.shown import first_of, point_colour, shown_of
from rbstab.report.sweeps.members import Members
from rbstab.report.sweeps.parameters import BinnedAxis, Parameter, binned
from rbstab.report.sweeps.quantities import MemberQuantity

MIN_EXPLAINED = 0.5
"""Cells of sampled members that explain less of the variance of a quantity have no map of it.

Two members of one cell then differ by more than the cells do: what the two parameters of the map
are says little of a member.
"""

START_OVER_LEVEL = "start-over-level"
"""Of conditions this has no maps: each condition has its own v, so that colours mean nothing."""

MAX_POINTS = 500
"""Up to this many words are drawn as points, more as a line."""

EMPTY = "An empty cell has no member."


MAX_SLICES = 6
"""Maximum number of slices along a third axis."""

MEMBERS_PER_CELL = 20
"""Average number of members in a cell of sampled values."""

MAX_SAMPLED_CELLS = 100
"""Maximum number of cells along an axis of sampled values."""

MIN_SAMPLED_FOR_MAPS = 320
"""Fewer sampled members are drawn as points; a map would have too few cells."""


class Mapped(NamedTuple):
    """What is shown: the name of a sweep, its members, and the members of each map.

    With several slices, each quantity has its own figure with a map for each slice.
    """

    name: str
    members: Members
    slices: list[Slice]


def over_parameters(
    name: str, members: Members, command: str = ""
) -> tuple[list[Figure], list[Block]]:
    """Return maps over two parameters and the effects of parameters, or curves along one.

    Args:
        name: The name of the sweep; the names of the figures begin with it.
        members: The members.
        command: The command that runs a member, without its number.

    Returns:
        At most two maps, or figures of curves; the first shows what became of the members, if they
        differ in it. Then the effect of each parameter of drawn members.
    """
    compared, slices = conditions_of(members).parameters, conditions_of(members).slices
    free = [p for p in members.parameters if p not in compared]
    if not free:
        return [], []
    what, effects = Mapped(name, members, slices), list[Block]()
    if len(free) == 1:
        maps = curves(what, free[0])
    elif members.is_drawn:
        parameter_effects = Effects(members, free, slices)
        maps, effects = _sample_maps(what, parameter_effects.order), parameter_effects.blocks(name)
    else:
        maps = _grid_maps(what, free)
    maps = [replace(figure, command=command) for figure in maps]
    return maps, effects


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


def map_figures(
    what: Mapped, axes: tuple[BinnedAxis, BinnedAxis], caption: str, *, most: int
) -> list[Figure]:
    """Return maps of what differs among the members, the deciding ones first.

    Args:
        what: The members, and those of each map.
        axes: The axes of the maps.
        caption: The caption of the figures.
        most: The largest number of figures of slices; members of one slice have two figures.
    """
    name, members, slices = what
    grids = [map_grid(*axes, chosen=part.chosen) for part in slices]
    shown = [quantity for quantity in shown_of(members) if _is_clear(quantity, grids)]
    over = f"over {axes[0].axis.label} and {axes[1].axis.label}"
    if any((grid.counts == 0).any() for grid in grids):
        caption = f"{caption} {EMPTY}".strip()
    if len(slices) == 1:
        count = first_of(shown)
        chosen = {"first": shown[:count], "map": shown[count:]}
    else:
        compared = [quantity for quantity in shown if quantity.name != START_OVER_LEVEL]
        chosen = {f"map-{quantity.name}": [quantity] for quantity in compared[:most]}
    figures = []
    for key, quantities in chosen.items():
        panels = tuple(panel for quantity in quantities for panel in _panels(what, grids, quantity))
        label = "Maps" if len(slices) == 1 else quantities[0].of_several.axis.label
        columns = 2 if len(slices) == 1 else 3
        title = f"{label[:1].upper()}{label[1:]} {over}"
        figure = Figure(f"{name}-{key}", title, panels, columns, caption=caption)
        figures += [replace(figure, shared="xy")] if panels else []
    return figures


def point_figure(what: Mapped, over: tuple[Parameter, Parameter]) -> Figure:
    """Return the outcome of each member as a point over two parameters."""
    x, y = over
    (outcome,) = (word for word in shown_of(what.members) if word.name == "outcome")
    panel = Panel(x.axis, y.axis, _points(outcome, x, y.values))
    title = f"Outcomes over {x.axis.label} and {y.axis.label}"
    caption = "Over the two parameters that explain most."
    return Figure(f"{what.name}-first", title, (panel,), caption=caption)


def _points(word: MemberQuantity, x: Parameter, y: Array) -> tuple[Points, ...]:
    """Return the members with each word as points over a parameter and over other values."""
    points = []
    for code, label in enumerate(word.axis.categories):
        indices = np.flatnonzero(word.values == code)
        across, numbers = x.values[indices].astype(float), tuple(indices.tolist())
        texts = tuple(
            f"{label}\n{x.axis.label} = {number(a)}\nmember {k}"
            for a, k in zip(across.tolist(), numbers, strict=True)
        )
        colour = point_colour(word, code)
        points.append(Points(across, y[indices].astype(float), label, colour, code, texts, numbers))
    return tuple(points)


def curves(what: Mapped, parameter: Parameter) -> list[Figure]:
    """Return figures of what differs along one parameter, with a curve for each slice."""
    panels, all_shown = [], shown_of(what.members)
    for quantity in all_shown:
        is_word = bool(quantity.axis.categories)
        marks: tuple[Mark, ...]
        if is_word and len(what.slices) == 1 and len(what.members) <= MAX_POINTS:
            marks = _points(quantity, parameter, quantity.values)
        else:
            marks = tuple(
                Line(*_along(parameter, quantity, part), part.title, colour, step=is_word)
                for colour, part in enumerate(what.slices)
            )
        panels.append(Panel(parameter.axis, quantity.axis, marks))
    count, title = first_of(all_shown), f"Along {parameter.axis.label}"
    chosen = {"first": tuple(panels[:count]), "curves": tuple(panels[count:])}
    return [Figure(f"{what.name}-{key}", title, group, 2) for key, group in chosen.items() if group]


def _along(parameter: Parameter, quantity: MemberQuantity, part: Slice) -> tuple[Array, Array]:
    """Return a parameter of the members of a slice in ascending order, and a quantity of each."""
    order = part.chosen[np.argsort(parameter.values[part.chosen], kind="stable")]
    return parameter.values[order].astype(float), quantity.values[order]


def _is_clear(shown: MemberQuantity, grids: list[MapGrid]) -> bool:
    """Return whether cells say what their members are: always unless they are sampled."""
    if grids[0].min_members < MIN_MEMBERS:
        return True
    quantity = shown.of_several
    # On a logarithmic scale, colours show ratios.
    values = np.log(quantity.values) if quantity.axis.log else quantity.values
    for grid in grids:
        filled = (grid.counts >= MIN_MEMBERS)[grid.cells]
        if explained(values[grid.chosen][filled], grid.cells[filled]) >= MIN_EXPLAINED:
            return True
    return False


def _panels(what: Mapped, grids: list[MapGrid], shown: MemberQuantity) -> list[Panel]:
    """Return the map of one quantity on each grid; all have one scale."""
    is_single = all(grid.is_single for grid in grids)
    quantity = shown if is_single else shown.of_several
    maps = [cells_of(what.members, grid, quantity) for grid in grids]
    values = np.concatenate([cells.values[np.isfinite(cells.values)] for cells in maps])
    if len(maps) > 1 and len(values) and not (quantity.axis.categories or quantity.is_share):
        span = (float(values.min()), float(values.max()))
        maps = [replace(cells, span=span) for cells in maps]
    x, y = grids[0].x, grids[0].y
    # Over two parameters of one kind a circle is round.
    same_kind = x.axis.unit == y.axis.unit and not x.axis.categories and not y.axis.categories
    ends = (x.middles[[0, -1]], y.middles[[0, -1]])
    square = same_kind and np.allclose(ends[0], ends[1], rtol=0.02, atol=0.0)
    return [
        Panel(x.axis, y.axis, (cells,), part.title or quantity.axis.text, square=square)
        for cells, part in zip(maps, what.slices, strict=True)
    ]
