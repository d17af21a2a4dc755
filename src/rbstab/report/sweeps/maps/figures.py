"""Figures of maps: a panel for each quantity, or for each slice of one quantity."""

from dataclasses import replace

import numpy as np

from rbstab.report.model.document import Block
from rbstab.report.model.figure import Cells, Figure, Mark, Panel, Points
from rbstab.report.sweeps.basins import basins_of
from rbstab.report.sweeps.conditions.paired_conditions import Slice
from rbstab.report.sweeps.maps.cell_values import (
    MapGrid,
    basin_cells,
    contour_line,
    map_grid,
    outcome_cells,
    proof_cells,
    quantity_cells,
)
from rbstab.report.sweeps.members import OUTCOMES, Members
from rbstab.report.sweeps.parameters import BinnedAxis, Parameter
from rbstab.report.sweeps.proofs import proof_codes
from rbstab.report.sweeps.quantities import MemberQuantity, mapped, start_over_level, varies

LEVEL = "v(0) = c*; proved at the start inside"

NO_PROOF = (
    "No proof is stored beside the results, so the maps show v(0) and not v(0) / c*; c* is the "
    "level of v below which convergence is proved. Run rbstab stability on the base config to make "
    "a proof."
)

NO_LEVEL = (
    "The members differ in more than their initial state, so each would need its own proof of "
    "c*, the level of v below which convergence is proved. The maps show v(0) and not v(0) / c*."
)


def map_figures(
    name: str,
    members: Members,
    axes: tuple[BinnedAxis, BinnedAxis],
    slices: list[Slice],
    caption: str,
) -> list[Block]:
    """Return maps of the outcomes, and of the quantities that vary.

    Args:
        name: The name of the sweep.
        members: The members.
        axes: The axes of the maps.
        slices: The members of each map; with several slices each quantity has its own figure.
        caption: The caption of the figures.
    """
    grids = [map_grid(*axes, chosen=part.chosen) for part in slices]
    quantities = [q for q in mapped(members) if varies(q.values)]
    over = f"over {axes[0].axis.label} and {axes[1].axis.label}"
    by_slice = [_maps_of(members, grid, quantities) for grid in grids]
    blocks: list[Block] = []
    if members.level is None and "start-energy" in {q.name for q in quantities}:
        blocks.append(NO_PROOF if members.share_proofs else NO_LEVEL)
    if len(slices) == 1:
        maps = by_slice[0].values()
        panels = tuple(_panel(members, grids[0], cells, cells.scale.text) for cells in maps)
        figure = Figure(f"{name}-map", f"Maps {over}", panels, 2, caption=caption)
        return [*blocks, figure] if panels else []
    for quantity_name in by_slice[0]:
        maps_on_scale = _on_one_scale([maps[quantity_name] for maps in by_slice])
        rows = zip(grids, maps_on_scale, slices, strict=True)
        panels = tuple(_panel(members, grid, cells, part.title) for grid, cells, part in rows)
        label = maps_on_scale[0].scale.label
        # Symbols such as v(0) are not capitalised.
        heading = label if "(" in label else label[:1].upper() + label[1:]
        blocks.append(
            Figure(f"{name}-map-{quantity_name}", f"{heading} {over}", panels, 3, caption=caption)
        )
    return blocks


def scatter_figure(
    name: str,
    members: Members,
    over: tuple[Parameter, Parameter],
    slices: list[Slice],
    caption: str,
) -> Figure:
    """Return the outcome of each member as a point over two parameters."""
    panels = []
    for part in slices:
        chosen = np.arange(len(members)) if part.chosen is None else part.chosen
        marks = []
        for code in np.flatnonzero(members.outcome_counts).tolist():
            own = chosen[members.outcomes[chosen] == code]
            texts = tuple(f"member {k}" for k in own.tolist())
            across, up = (p.values[own].astype(float) for p in over)
            marks.append(Points(across, up, OUTCOMES[code], code, code, texts))
        panels.append(Panel(over[0].axis, over[1].axis, tuple(marks), part.title))
    title = f"Outcomes over {over[0].axis.label} and {over[1].axis.label}"
    columns = min(len(panels), 3)
    return Figure(f"{name}-map", title, tuple(panels), columns, caption=caption)


def _maps_of(members: Members, grid: MapGrid, quantities: list[MemberQuantity]) -> dict[str, Cells]:
    """Return the maps on a grid, by the name of their quantity."""
    maps = {quantity.name: quantity_cells(grid, quantity) for quantity in quantities}
    basins = basins_of(members)
    if basins is not None:
        maps = {"basins": basin_cells(basins, grid)} | maps
    if len(proof_codes(members).labels) > 1:
        maps = {"proofs": proof_cells(members, grid)} | maps
    if np.count_nonzero(members.outcome_counts) > 1:
        return {"outcome": outcome_cells(members, grid)} | maps
    return maps


def _on_one_scale(maps: list[Cells]) -> list[Cells]:
    """Return the maps of one quantity with a common colour scale."""
    values = np.concatenate([cells.values.ravel() for cells in maps])
    finite = values[np.isfinite(values)]
    if maps[0].scale.categories or maps[0].span is not None or not len(finite):
        return maps
    span = (float(finite.min()), float(finite.max()))
    return [replace(cells, span=span) for cells in maps]


def _panel(members: Members, grid: MapGrid, cells: Cells, title: str) -> Panel:
    marks: list[Mark] = [cells]
    level = start_over_level(members)
    if level is not None:
        curve = contour_line(grid, level.values, 1.0, LEVEL)
        marks += [] if curve is None else [curve]
    return Panel(grid.x.axis, grid.y.axis, tuple(marks), title)
