"""Maps of a sweep over two of its parameters, and curves along a single one."""

import numpy as np

from rbstab.report.model.document import Block
from rbstab.report.sweeps.influence import Influence
from rbstab.report.sweeps.maps.cell_values import MIN_MEMBERS
from rbstab.report.sweeps.maps.curves import curves
from rbstab.report.sweeps.maps.figures import map_figures, scatter_figure
from rbstab.report.sweeps.members import ENDS, Members
from rbstab.report.sweeps.paired_conditions import Slice, paired_conditions_of
from rbstab.report.sweeps.parameters import Parameter, cut

MAX_SLICES = 6
"""Maps of one quantity side by side."""

PER_CELL = 20
"""Members that a cell of drawn values has on average."""

MAX_DRAWN_CELLS = 100
"""Along an axis of drawn values."""

MIN_DRAWN = 320
"""Members below which drawn ones are shown one by one: there would be too few cells."""


def map_blocks(name: str, members: Members) -> list[Block]:
    """Maps over two parameters, or curves along one.

    Args:
        name: Of the sweep, with which the names of figures begin.
        members: The members.
    """
    groups = paired_conditions_of(members)
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
        said += f" Along {names} cells hold the share or the median of their members."
    figures = map_figures(name, members, (cut(first), cut(second)), slices, said.strip())
    return [*_alike(members), *figures]


def _of_drawn(
    name: str, members: Members, free: list[Parameter], slices: list[Slice]
) -> list[Block]:
    """Maps over the two parameters on which the outcome depends most."""
    influence = Influence(members)
    first, second = [p for k in influence.order if (p := influence.parameters[k]) in free][:2]
    blocks: list[Block] = [influence.table(f"{name}-influence"), *_alike(members)]
    said = "Over the two parameters with the largest sum of correlation ratios."
    if len(members) // len(slices) < MIN_DRAWN:
        if np.count_nonzero(members.counts) > 1:
            blocks.append(scatter_figure(name, members, (first, second), slices, said))
        return blocks
    most = drawn_cells(len(members) // len(slices))
    said += (
        f" Cells hold the share or the median of their members, about {PER_CELL} or "
        f"more on average; a cell with fewer than {MIN_MEMBERS} is empty."
    )
    return blocks + map_figures(name, members, (cut(first, most), cut(second, most)), slices, said)


def _alike(members: Members) -> list[Block]:
    """What is said instead of a map of outcomes where there is only one."""
    if np.count_nonzero(members.counts) > 1:
        return []
    end = ENDS[int(members.counts.argmax())]
    return [f"All members ended alike ({end}), so that there is no map of how they ended."]


def drawn_cells(members: int) -> int:
    """The cells along an axis of drawn values, for so many members."""
    return int(np.clip(np.sqrt(members / PER_CELL), 2, MAX_DRAWN_CELLS))


def _slices_along(parameter: Parameter) -> list[Slice]:
    entries = parameter.entries
    picked = np.unique(np.linspace(0, len(entries) - 1, MAX_SLICES).round().astype(int))
    return [
        Slice(f"{parameter.axis.label} = {entry:.4g}", np.flatnonzero(parameter.values == entry))
        for entry in entries[picked].tolist()
    ]
