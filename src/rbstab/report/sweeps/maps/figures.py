"""Figures of maps: a panel for each quantity, or for each slice of one quantity."""

from collections.abc import Collection
from typing import NamedTuple

import numpy as np

from rbstab.report.model.document import Block
from rbstab.report.model.figure import Cells, Figure, Mark, Panel
from rbstab.report.sweeps.basins import basins_of
from rbstab.report.sweeps.conditions.paired_conditions import Slice
from rbstab.report.sweeps.maps.cell_grid import MapGrid, map_grid
from rbstab.report.sweeps.maps.cell_values import (
    basin_cells,
    contour_line,
    outcome_cells,
    proof_cells,
    quantity_cells,
)
from rbstab.report.sweeps.maps.colour_ranges import has_one_colour, on_one_scale, one_colour_note
from rbstab.report.sweeps.maps.marked import extremes, failed_points, member_points, value_text
from rbstab.report.sweeps.members import OUTCOMES, POINT_COLOURS, Members
from rbstab.report.sweeps.parameters import BinnedAxis, Parameter
from rbstab.report.sweeps.proofs import proof_codes
from rbstab.report.sweeps.quantities import (
    MemberQuantity,
    final_tilt,
    mapped,
    start_over_level,
    varies,
)

LEVEL = "v(0) = c*; proved at the start inside"
MEDIAN_LEVEL = "median v(0) = c*; inside, at least half of each cell is proved at the start"
"""What the curve on a map is: for cells of one member, and for cells of several."""

NO_PROOF = (
    "No proof is stored beside the results, so the maps show v(0) and not v(0) / c*; c* is the "
    "level of v below which convergence is proved. Run rbstab stability on the base config to make "
    "a proof."
)

NO_LEVEL = (
    "The plan varies more than the initial state, so each member would need its own proof of c*, "
    "the level of v below which convergence is proved. The maps show v(0) and not v(0) / c*."
)


FIRST = ("outcome", "final-tilt")
"""Names of the maps that are shown first: what became of the members, and how far they lean."""

WORDS = ("outcome", "basins", "proofs")
"""Names of the maps of words, or of shares: these have no extremes to mark."""

EMPTY = "An empty cell has no member."


class Mapped(NamedTuple):
    """What is mapped: the name of a sweep, its members, and the members of each map.

    With several slices, each quantity has its own figure with a map for each slice.
    """

    name: str
    members: Members
    slices: list[Slice]


def map_figures(
    what: Mapped,
    axes: tuple[BinnedAxis, BinnedAxis],
    caption: str,
    *,
    left_out: Collection[str] = (),
) -> list[Block]:
    """Return maps of the outcomes, and of the quantities that vary.

    Args:
        what: The members, and those of each map.
        axes: The axes of the maps.
        caption: The caption of the figures.
        left_out: Names of maps that are not drawn.
    """
    name, members, slices = what
    grids = [map_grid(*axes, chosen=part.chosen) for part in slices]
    quantities = [q for q in mapped(members) if varies(q.values) and q.name not in left_out]
    over = f"over {axes[0].axis.label} and {axes[1].axis.label}"
    by_slice = [_maps_of(members, grid, quantities, left_out) for grid in grids]
    borders = [_Border(members, grid) for grid in grids]
    has_empty = any((grid.counts == 0).any() for grid in grids)
    blocks: list[Block] = list(_sentences(members, {q.name for q in quantities}))

    notes = [caption, EMPTY] if has_empty else [caption]
    if len(slices) == 1:
        maps = by_slice[0]
        if not maps:
            return blocks
        first = {key: maps.pop(key) for key in FIRST if key in maps}
        for title, chosen in (("first", first), ("map", maps)):
            if not chosen:
                continue
            panels = [
                _panel(
                    grids[0],
                    on_one_scale([cells])[0],
                    cells.scale.text,
                    borders[0].marks(key),
                    marked=_is_marked(key, [cells]),
                )
                for key, cells in chosen.items()
            ]
            own = [*notes, *(one_colour_note([cells]) for cells in chosen.values())]
            blocks.append(_figure(f"{name}-{title}", f"Maps {over}", panels, 2, own))
        return blocks
    for key in by_slice[0]:
        unscaled = [maps[key] for maps in by_slice]
        marked = _is_marked(key, unscaled)
        rows = zip(grids, on_one_scale(unscaled), slices, borders, strict=True)
        panels = [
            _panel(grid, cells, part.title, border.marks(key), marked=marked)
            for grid, cells, part, border in rows
        ]
        label = unscaled[0].scale.label
        # Symbols such as v(0) are not capitalised.
        heading = label if "(" in label else label[:1].upper() + label[1:]
        title, own = f"{heading} {over}", [*notes, one_colour_note(unscaled)]
        blocks.append(_figure(f"{name}-map-{key}", title, panels, 3, own))
    return blocks


def _figure(name: str, title: str, panels: list[Panel], columns: int, notes: list[str]) -> Figure:
    caption = " ".join(note for note in notes if note)
    return Figure(name, title, tuple(panels), columns, caption=caption, shared="xy")


def _is_marked(key: str, maps: list[Cells]) -> bool:
    """Return whether the extremes of maps of a quantity are marked: not those of one colour."""
    return key not in WORDS and not has_one_colour(maps)


def scatter_figure(what: Mapped, over: tuple[Parameter, Parameter], caption: str) -> Figure:
    """Return each member as a point: its outcome over two parameters, its tilt over the first."""
    name, members, slices = what
    across, *up = ((p.axis, p.values) for p in over)
    tilt = final_tilt(members)
    panels = []
    for y in (*up, (tilt.axis, tilt.values)):
        for part in slices:
            chosen = np.arange(len(members)) if part.chosen is None else part.chosen
            marks = tuple(
                member_points(
                    chosen[members.outcomes[chosen] == code],
                    across,
                    y,
                    OUTCOMES[code],
                    (POINT_COLOURS[code], code),
                )
                for code in np.flatnonzero(members.outcome_counts).tolist()
            )
            panels.append(Panel(across[0], y[0], marks, part.title))
    title = f"Outcomes over {over[0].axis.label} and {over[1].axis.label}, and final tilt"
    columns = max(2, min(len(slices), 3))
    return Figure(f"{name}-first", title, tuple(panels), columns, caption=caption)


def _sentences(members: Members, shown: Collection[str]) -> list[str]:
    """Return what the maps do not show: a proof's level, and quantities without a difference."""
    found = []
    if members.level is None and "start-energy" in shown:
        found.append(NO_PROOF if members.share_proofs else NO_LEVEL)
    alike = [q for q in mapped(members) if not varies(q.values)]
    values = [value_text(q.axis, float(q.values[np.isfinite(q.values)][0])) for q in alike]
    same = [f"{q.axis.label} = {value}" for q, value in zip(alike, values, strict=True)]
    if same:
        found.append(f"The same for all members, so there is no map of it: {'; '.join(same)}.")
    return found


def _maps_of(
    members: Members, grid: MapGrid, quantities: list[MemberQuantity], left_out: Collection[str]
) -> dict[str, Cells]:
    """Return the maps on a grid, by the name of their quantity; those in `FIRST` come first."""
    maps = {}
    if np.count_nonzero(members.outcome_counts) > 1 and "outcome" not in left_out:
        maps["outcome"] = outcome_cells(members, grid)
    of_quantities = {q.name: quantity_cells(members, grid, q) for q in quantities}
    maps |= {key: of_quantities.pop(key) for key in FIRST if key in of_quantities}
    if len(proof_codes(members).labels) > 1 and "proofs" not in left_out:
        maps["proofs"] = proof_cells(members, grid)
    basins = basins_of(members)
    if basins is not None and "basins" not in left_out:
        maps["basins"] = basin_cells(basins, grid)
    return maps | of_quantities


class _Border:
    """What all maps on a grid show: the curve on which v(0) = c*, and members that failed."""

    def __init__(self, members: Members, grid: MapGrid) -> None:
        self._failed: list[Mark] = list(failed_points(members, grid))
        self._curve: list[Mark] = []
        level = start_over_level(members)
        if level is not None:
            label = LEVEL if grid.is_single else MEDIAN_LEVEL
            curve = contour_line(grid, level.values, 1.0, label)
            self._curve = [] if curve is None else [curve]

    def marks(self, key: str) -> list[Mark]:
        """Return the marks on a map of a quantity; that of proofs shows the curve by its cells."""
        return self._failed if key == "proofs" else self._curve + self._failed


def _panel(grid: MapGrid, cells: Cells, title: str, border: list[Mark], *, marked: bool) -> Panel:
    """Return a map with the border of the proved start, and its extremes if it is to be marked."""
    found = extremes(cells, grid.x.axis, grid.y.axis) if marked else []
    x, y = grid.x, grid.y
    # Over two parameters of one kind a circle is round.
    one_kind = x.axis.unit == y.axis.unit and not x.axis.categories and not y.axis.categories
    square = one_kind and all(
        np.isclose(x.middles[end], y.middles[end], rtol=0.02) for end in (0, -1)
    )
    return Panel(x.axis, y.axis, (cells, *border, *found), title, square=square)
