"""What the scripts of a page need of a figure besides plotly's data: axes, cells, the command."""

from typing import Any

from rbstab.report.model.figure import Axis, CellMembers, Cells, Figure
from rbstab.report.writers.plotly_figures.text import packed_array, packed_integers

JSON = dict[str, Any]


def page_data(figure: Figure) -> JSON:
    """Return the axes of the panels, the cells of the maps, and the command of a member.

    Returns:
        `panels`: for each panel its title and axes. `cells`: for each panel its map, or None:
        the centres of the cells, the scale, and the members in them. Arrays that several maps have
        in common are given once, in `arrays`; the maps have their indices. `command`: the command
        that runs a member, without the number.
    """
    arrays: list[JSON] = []

    def index(packed: JSON) -> int:
        if packed not in arrays:
            arrays.append(packed)
        return arrays.index(packed)

    def cells_of(cells: Cells) -> JSON:
        found: JSON = {
            "x": index(packed_array(cells.x)),
            "y": index(packed_array(cells.y)),
            "scale": _axis(cells.scale) | {"log": cells.scale.log},
        }
        return found if cells.members is None else found | members_of(cells.members)

    def members_of(members: CellMembers) -> JSON:
        numbers = {"counts": members.counts, "shown": members.shown, "gaps": members.gaps}
        return {
            "role": members.role,
            "reasons": list(members.reasons),
            **{name: index(packed_integers(array)) for name, array in numbers.items()},
        }

    maps = [[m for m in panel.marks if isinstance(m, Cells)] for panel in figure.panels]
    return {
        "panels": [
            {"title": panel.title, "x": _axis(panel.x), "y": _axis(panel.y)}
            for panel in figure.panels
        ],
        "cells": [cells_of(found[0]) if found else None for found in maps],
        "arrays": arrays,
        "command": figure.command,
    }


def _axis(axis: Axis) -> JSON:
    return {
        "label": axis.label,
        "unit": "" if axis.unit == "1" else axis.unit,
        "text": axis.text,
        "categories": list(axis.categories),
    }
