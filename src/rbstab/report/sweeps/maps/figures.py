"""The figures of maps: a panel for each quantity, or for each slice of one quantity."""

from dataclasses import replace

import numpy as np

from rbstab.report.model.document import Block
from rbstab.report.model.figure import Cells, Figure, Mark, Panel, Points
from rbstab.report.sweeps.maps.cell_values import Area, area_of, end_cells, outline, quantity_cells
from rbstab.report.sweeps.members import ENDS, Members
from rbstab.report.sweeps.paired_conditions import Slice
from rbstab.report.sweeps.parameters import Cut, Parameter
from rbstab.report.sweeps.quantities import Quantity, mapped, start_over_level, varies

LEVEL = "v(0) = c*: inside, convergence is proved"

NO_PROOF = (
    "No proof of c*, the level of v below which convergence is proved, is kept beside the results "
    "(rbstab stability makes one of the base); v(0) stands alone."
)

NO_LEVEL = (
    "Members differ in more than their start, so that each would need a proof of its own: v(0) "
    "stands without the level c* below which convergence is proved."
)


def map_figures(
    name: str, members: Members, cuts: tuple[Cut, Cut], slices: list[Slice], said: str
) -> list[Block]:
    """Maps of how members ended and of their numbers, as far as these vary.

    Args:
        name: Of the sweep.
        members: The members.
        cuts: What is along the axes, in cells.
        slices: Members with maps of their own; of several, each quantity has a figure.
        said: What a reader has to know of the cells.
    """
    areas = [area_of(*cuts, chosen=part.chosen) for part in slices]
    quantities = [q for q in mapped(members) if varies(q.values)]
    over = f"over {cuts[0].axis.label} and {cuts[1].axis.label}"
    by_slice = [_maps_of(members, area, quantities) for area in areas]
    blocks: list[Block] = []
    if members.level is None and "start-energy" in {q.name for q in quantities}:
        blocks.append(NO_PROOF if members.share_proofs else NO_LEVEL)
    if len(slices) == 1:
        drawn = by_slice[0].values()
        panels = tuple(_panel(members, areas[0], cells, cells.scale.text) for cells in drawn)
        figure = Figure(f"{name}-map", f"Maps {over}", panels, 2, caption=said)
        return [*blocks, figure] if panels else []
    for short in by_slice[0]:
        same = _on_one_scale([cells[short] for cells in by_slice])
        rows = zip(areas, same, slices, strict=True)
        panels = tuple(_panel(members, area, cells, part.title) for area, cells, part in rows)
        label = same[0].scale.label
        # A symbol stays as it is: v(0).
        heading = label if "(" in label else label[:1].upper() + label[1:]
        blocks.append(Figure(f"{name}-map-{short}", f"{heading} {over}", panels, 3, caption=said))
    return blocks


def scatter_figure(
    name: str, members: Members, over: tuple[Parameter, Parameter], slices: list[Slice], said: str
) -> Figure:
    """How each member ended, as a point over two parameters."""
    panels = []
    for part in slices:
        chosen = np.arange(len(members)) if part.chosen is None else part.chosen
        marks = []
        for code in np.flatnonzero(members.counts).tolist():
            own = chosen[members.ends[chosen] == code]
            texts = tuple(f"member {k}" for k in own.tolist())
            across, up = (p.values[own].astype(float) for p in over)
            marks.append(Points(across, up, ENDS[code], code, code, texts))
        panels.append(Panel(over[0].axis, over[1].axis, tuple(marks), part.title))
    title = f"How members ended, over {over[0].axis.label} and {over[1].axis.label}"
    columns = min(len(panels), 3)
    return Figure(f"{name}-map", title, tuple(panels), columns, caption=said)


def _maps_of(members: Members, area: Area, quantities: list[Quantity]) -> dict[str, Cells]:
    """The maps of an area by the names of what they show."""
    found = {"outcome": end_cells(members, area)} if np.count_nonzero(members.counts) > 1 else {}
    return found | {quantity.name: quantity_cells(area, quantity) for quantity in quantities}


def _on_one_scale(maps: list[Cells]) -> list[Cells]:
    """Maps of one quantity with the same colours."""
    values = np.concatenate([cells.values.ravel() for cells in maps])
    finite = values[np.isfinite(values)]
    if maps[0].scale.words or maps[0].span is not None or not len(finite):
        return maps
    span = (float(finite.min()), float(finite.max()))
    return [replace(cells, span=span) for cells in maps]


def _panel(members: Members, area: Area, cells: Cells, title: str) -> Panel:
    marks: list[Mark] = [cells]
    level = start_over_level(members)
    if level is not None:
        curve = outline(area, level.values, 1.0, LEVEL)
        marks += [] if curve is None else [curve]
    return Panel(area.x.axis, area.y.axis, tuple(marks), title)
