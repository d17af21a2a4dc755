"""What the reports of two made up sweeps say: a grid, and drawn members of two conditions.

`python -m report.sweeps.said` writes it to `tests/data/sweep_reports.json` again, after a change of
words or of what is shown: read the difference, in which no number may change.
"""

import json
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from support.made_sweeps import SPIN, code, write_sweep

from rbstab.report.build import report_of
from rbstab.report.model.figure import Figure
from rbstab.report.reading.sources import read_sources
from rbstab.report.writers.plain_data import data_of

FILE = Path(__file__).parents[2] / "data" / "sweep_reports.json"

ACROSS, UP = f"{SPIN}[0]", f"{SPIN}[1]"


def of_grid(a):
    """Half of the members return, some of them proved; others rest elsewhere, leave or fail."""
    x, y = a["initial_angular_velocity_0"], a["initial_angular_velocity_1"]
    size = np.hypot(x, y - 12.0)
    status = np.select([size > 17, (x == 2) & (y == 0)], [code("range left"), code("diverged")], 0)
    return {
        "settling_time": np.where(size < 14, 0.3 + 0.05 * size, np.nan),
        "status": status,
        "final_orientation": np.outer(0.01 * size, [1.0, 0.0, 0.0]),
        "rest_orientation": np.outer(np.where(x < -2, 0.6, 0.0), [1.0, 0.0, 0.0]),
        "peak_contact_displacement": np.outer(size, [0.01, -0.02, 0.005]),
        "smallest_regularity": 1.0 - size / 25.0,
        "lyapunov_start": size**2,
        "convergence": np.where(size < 6, 2, 1),
        "proved_rest_state": size < 6,
    }


def of_conditions(a):
    """The second variant settles earlier, by more for large spins; some of the first leave."""
    late, spin = 1.0 - a["controller_variant"], np.abs(a["initial_angular_velocity_0"])
    mass = a["body_mass"]
    return {
        "settling_time": np.where(spin > 14, np.nan, 0.5 + 0.1 * spin + (0.2 + 0.03 * spin) * late),
        "status": np.where((late > 0) & (spin > 12) & (mass > 1.5), code("range left"), 0),
        "peak_contact_displacement": np.outer(mass * (0.02 + 0.01 * late), [1.0, -1.0, 0.5]),
        "smallest_regularity": np.exp(-0.05 * spin - 0.1 * late),
        "lyapunov_start": spin**2,
    }


SWEEPS: dict[str, tuple[Any, Any, Any]] = {
    "grid": (
        {ACROSS: {"linspace": [-3, 3, 7]}, UP: {"linspace": [0, 30, 6]}},
        of_grid,
        {"prove": "motion"},
    ),
    "conditions": (
        {
            "controller.variant": {"each": {"values": ["visco-elastic", "free"]}},
            ACROSS: {"normal": [0, 6]},
            "body.mass": {"uniform": [1, 2]},
        },
        of_conditions,
        {"design": "random", "members": 400, "seed": 2},
    ),
}
"""By name: what varies, the columns, and the other keys of the plan."""


def said(name, folder):
    """Return the sections of the report of a sweep, with a summary of each mark of its figures."""
    vary, columns, keys = SWEEPS[name]
    path = write_sweep(folder / "members.h5", vary, columns, **keys).path
    report = report_of(read_sources([path]), "again")
    sections = data_of(report)["sections"]
    for section, data in zip(report.sections, sections, strict=True):
        for block, block_data in zip(section.blocks, data["blocks"], strict=True):
            if isinstance(block, Figure):
                block_data["panels"] = [_panel(panel) for panel in block.panels]
    text = json.dumps(_rounded(sections[:-1]), allow_nan=True)
    # The last section has versions and paths.
    rounded: list[Any] = json.loads(text.replace(str(folder.parent), "DIR"))
    return rounded


def _panel(panel):
    marks = [
        " ".join([type(mark).__name__, *map(_summary, filter(_is_data, vars(mark).values()))])
        for mark in panel.marks
    ]
    return {"title": panel.title, "x": panel.x.text, "y": panel.y.text, "marks": marks}


def _is_data(value):
    return isinstance(value, np.ndarray) and value.dtype.kind in "fiu"


def _summary(values):
    """Return how many finite numbers there are, their sum, and the sum of their squares."""
    finite = values[np.isfinite(values)].astype(float)
    return f"({len(finite)}, {finite.sum():.9g}, {(finite**2).sum():.9g})"


def _rounded(data):
    """Round numbers to nine digits, so that no round-off counts."""
    if isinstance(data, dict):
        return {key: _rounded(value) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [_rounded(value) for value in data]
    return float(f"{data:.9g}") if isinstance(data, float) else data


if __name__ == "__main__":
    with TemporaryDirectory() as place:
        sections = {name: said(name, Path(place) / name) for name in SWEEPS}
    FILE.write_text(json.dumps(sections, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
