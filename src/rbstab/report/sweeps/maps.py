"""Maps of a sweep over two of its parameters, and curves along a single one."""

import numpy as np

from rbstab.report.document import Block
from rbstab.report.figure import Cells, Figure, Mark, Panel
from rbstab.report.sweeps.cell_values import Area, area_of, end_cells, outline, quantity_cells
from rbstab.report.sweeps.circumstances import Slice, circumstances_of
from rbstab.report.sweeps.curves import curves
from rbstab.report.sweeps.influence import Influence
from rbstab.report.sweeps.members import Members
from rbstab.report.sweeps.parameters import Cut, Parameter, cut
from rbstab.report.sweeps.quantities import Quantity, mapped, start_over_level, varies

MOST_SLICES = 6
"""Maps of one quantity side by side."""

PER_CELL = 20
"""Members that a cell of drawn values has on average."""

MOST_DRAWN_CELLS = 100
"""Along an axis of drawn values."""

LEVEL = "v(0) = c*: inside, convergence is proved"


def map_blocks(name: str, members: Members) -> list[Block]:
    """Maps over two parameters, or curves along one.

    Args:
        name: Of the sweep, with which the names of figures begin.
        members: The members.
    """
    groups = circumstances_of(members)
    apart = groups.parameters if groups is not None else ()
    free = [p for p in members.parameters if p not in apart]
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
        return _of_grid(name, members, free, slices)
    return _of_drawn(name, members, free, slices)


def _of_grid(
    name: str, members: Members, free: list[Parameter], slices: list[Slice]
) -> list[Block]:
    """Maps over the two longest axes of a grid; a third one is cut into slices."""
    longest = sorted(free, key=lambda p: -len(p.entries))
    first, second = (p for p in free if p in longest[:2])
    others = longest[2:]
    said = ""
    if others and len(slices) == 1:
        slices = _slices_along(others[0])
        said = f"Slices at some of the values of {others[0].axis.label}."
        others = others[1:]
    if others:
        names = ", ".join(p.axis.label for p in others)
        said += f" Along {names} the share that settled, or the median, is drawn."
    # The last key of a plan is its fastest: upright here, as in the table of its members.
    return _maps(name, members, (cut(first), cut(second)), slices, said.strip())


def _of_drawn(
    name: str, members: Members, free: list[Parameter], slices: list[Slice]
) -> list[Block]:
    """Maps over the two parameters on which the outcome depends most."""
    influence = Influence(members)
    ranked = [influence.parameters[k] for k in influence.order]
    ranked = [p for p in ranked if p in free]
    most = drawn_cells(len(members) // len(slices))
    cuts = (cut(ranked[0], most), cut(ranked[1], most))
    said = (
        f"Over the two parameters with the largest sum of correlation ratios. Cells hold the share "
        f"that settled, or the median, of their members, about {PER_CELL} or more; a cell with "
        "fewer than 5 is empty."
    )
    blocks: list[Block] = [influence.table(f"{name}-influence")]
    return blocks + _maps(name, members, cuts, slices, said)


def drawn_cells(members: int) -> int:
    """The cells along an axis of drawn values, for so many members."""
    return int(np.clip(np.sqrt(members / PER_CELL), 2, MOST_DRAWN_CELLS))


def _slices_along(parameter: Parameter) -> list[Slice]:
    entries = parameter.entries
    picked = np.unique(np.linspace(0, len(entries) - 1, MOST_SLICES).round().astype(int))
    return [
        Slice(f"{parameter.axis.label} = {entry:.4g}", np.flatnonzero(parameter.values == entry))
        for entry in entries[picked].tolist()
    ]


def _maps(
    name: str, members: Members, cuts: tuple[Cut, Cut], slices: list[Slice], said: str
) -> list[Block]:
    areas = [area_of(*cuts, chosen=part.chosen) for part in slices]
    found = [q for q in mapped(members) if varies(q.values)]
    blocks: list[Block] = []
    if np.count_nonzero(members.counts) < 2:
        blocks.append("All members ended alike, so that there is no map of how they ended.")
    over = f"over {cuts[0].axis.label} and {cuts[1].axis.label}"
    if len(slices) == 1:
        cells_of = _all(members, areas[0], found).values()
        panels = [_panel(members, areas[0], cells, "") for cells in cells_of]
        blocks += [Figure(f"{name}-map", f"Maps {over}", tuple(panels), 2, caption=said)]
        return blocks if panels else blocks[:-1]
    by_slice = [_all(members, area, found) for area in areas]
    for short in by_slice[0]:
        same = [cells[short] for cells in by_slice]
        drawn = zip(areas, same, slices, strict=True)
        panels = [_panel(members, area, cells, part.title) for area, cells, part in drawn]
        label = same[0].scale.label
        title = f"{label[:1].upper()}{label[1:]} {over}"
        blocks.append(Figure(f"{name}-map-{short}", title, tuple(panels), 3, caption=said))
    return blocks


def _all(members: Members, area: Area, found: list[Quantity]) -> dict[str, Cells]:
    """The maps of an area by the names of what they show."""
    cells = {} if np.count_nonzero(members.counts) < 2 else {"outcome": end_cells(members, area)}
    return cells | {quantity.name: quantity_cells(area, quantity) for quantity in found}


def _panel(members: Members, area: Area, cells: Cells, title: str) -> Panel:
    marks: list[Mark] = [cells]
    level = start_over_level(members)
    if level is not None:
        curve = outline(area, level.values, 1.0, LEVEL)
        marks += [] if curve is None else [curve]
    equal = area.x.axis.unit == area.y.axis.unit != "" and _alike(area)
    return Panel(area.x.axis, area.y.axis, tuple(marks), title or cells.scale.text, equal)


def _alike(area: Area) -> bool:
    """Whether both axes are about equally long and linear, so that a square is drawn as one."""
    if area.x.axis.log or area.y.axis.log or area.x.axis.unit == "1":
        return False
    x, y = np.ptp(area.x.middles), np.ptp(area.y.middles)
    return bool(0.5 <= x / y <= 2)
