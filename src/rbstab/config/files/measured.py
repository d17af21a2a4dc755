"""Reading a measured motion: a CSV file with a name and a unit above each column."""

import math
from dataclasses import dataclass
from pathlib import Path as FilePath
from typing import NamedTuple

import numpy as np

from rbstab.config.errors import ConfigError, ConfigProblem, Location
from rbstab.config.files.named_files import csv_rows, finite_number
from rbstab.config.source import read_text
from rbstab.mechanics.numbers import Array

DEGREE = math.radians(1.0)

LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}

TIME = "time [s]"
"""The head of the first column."""

VECTORS = {
    "Theta": {"rad": 1.0, "deg": DEGREE},
    "Omega": {"rad/s": 1.0, "deg/s": DEGREE},
    "X": LENGTHS,
    "E": LENGTHS,
}
"""The vectors of a `Motion` that may be measured, with their units, the SI unit first."""


class Column(NamedTuple):
    """What was measured in a column: `theta2` is the axis 1 of `Motion.Theta`, in rad."""

    name: str
    vector: str
    axis: int
    unit: str


HEADS = {
    f"{name} [{unit}]": (Column(name, vector, axis, next(iter(units))), factor)
    for vector, units in VECTORS.items()
    for axis in range(3)
    for name in [f"{vector.lower()}{axis + 1}"]
    for unit, factor in units.items()
}
"""The heads of the other columns: what they have, and what makes their numbers SI."""


@dataclass(frozen=True, eq=False)
class Measured:
    """A measured motion.

    Attributes:
        times: Ascending, from the start of the run, s, shape (n,).
        columns: What was measured, m columns.
        values: Shape (n, m), SI; NaN where nothing was measured.
    """

    times: Array
    columns: tuple[Column, ...]
    values: Array


def read_measured(file: str | FilePath, duration: float = math.inf) -> Measured:
    """Read a measured motion: `time [s],theta1 [deg],x3 [mm]`, then rows of numbers.

    The columns are the Euler angles theta1 to theta3, the angular velocity omega1 to omega3, the
    centre of gravity x1 to x3, and the contact displacement e1 to e3, as the paper defines them.
    An empty cell is a gap. Lines that begin with # are comments.

    Args:
        file: The path of the file.
        duration: The end of the run, s; later times are refused.

    Raises:
        ConfigError: The file is wrong; the error has all problems, each with line and column.
    """
    problems: list[ConfigProblem] = []

    def report(line: int, column: int, problem: str, expected: str) -> None:
        problems.append(ConfigProblem(Location(str(file), line, column), "", problem, expected))

    try:
        rows = list(csv_rows(read_text(FilePath(file))))
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        report(1, 1, f"cannot be read: {reason}", "expected a CSV file")
        raise ConfigError(problems) from error
    (line, heads), *rows = rows or [(1, [(1, "")])]
    place, text = heads[0]
    if text != TIME or len(heads) == 1:
        report(line, place, f"is '{text}'", f"expected {TIME}, then a comma and other columns")
        raise ConfigError(problems)
    columns, factors = list[Column](), [1.0]
    for place, text in heads[1:]:
        column, factor = HEADS.get(text, (Column(text, "", 0, ""), 1.0))
        if text not in HEADS or column in columns:
            wanted = "theta1 [deg], omega1 [rad/s], x1 [mm] or e1 [m], with 1 to 3, each once"
            report(line, place, f"is '{text}'", f"expected such as {wanted}")
        columns.append(column)
        factors.append(factor)
    # The first time may be 0.
    values, last = np.full((len(rows), len(heads)), math.nan), -1e-300
    for row, (line, cells) in zip(values, rows, strict=True):
        if len(cells) != len(heads):
            report(line, 1, f"has {len(cells)} cells", f"expected {len(heads)}")
            continue
        for k, (place, text) in enumerate(cells):
            number = finite_number(text)
            if number is not None:
                row[k] = number * factors[k]
            elif k == 0 or text.lower() not in ("", "nan"):
                report(line, place, f"is '{text}'", "expected a finite number; a gap is empty")
        # Of times after the end, the first is told.
        if row[0] <= last or row[0] > duration >= last:
            wanted = f"expected rising times from 0 to {duration:g} s, the end of the run"
            report(line, cells[0][0], f"is the time {row[0]:g} s", wanted)
        last = max(last, row[0])
    if problems:
        raise ConfigError(problems)
    return Measured(values[:, 0], tuple(columns), values[:, 1:])
