"""Sweep files with made up members, written by the store from a real plan."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from rbstab.integrate.status import RunStatus
from rbstab.report.reading.sources import SweepFile
from rbstab.store.table import TableHeader
from rbstab.store.table_writer import write_table
from rbstab.store.variables import Variable
from rbstab.sweep.folder.layout import grid_extras, varied_arrays, varied_layout
from rbstab.sweep.members.outcome import STATUSES, columns_of
from rbstab.sweep.plan.dump import plan_yaml
from rbstab.sweep.plan.load import load_plan
from rbstab.sweep.plan.plan import Plan
from rbstab.sweep.proofs.columns import GATHERED_COLUMNS
from support.configs import VISCO_ELASTIC, plain

SPIN = "initial.angular_velocity"

GRID = {f"{SPIN}[0]": {"linspace": [-2, 2, 5]}, f"{SPIN}[1]": {"linspace": [0, 30, 4]}}
"""20 members: five spins about the first axis, four about the second; the second varies fastest."""

Columns = Callable[[dict[str, Any]], dict[str, Any]]

BATCH_SIZE = 1 << 16


def code(status: str) -> int:
    """Return the code of a status in a file."""
    return STATUSES.index(RunStatus(status))


def write_sweep(
    path: Path, vary: dict[str, Any], columns: Columns = lambda _: {}, **plan_keys: Any
) -> SweepFile:
    """Write a sweep file and return it as a source of a report.

    Args:
        path: The file.
        vary: The key `vary` of the plan.
        columns: Returns replaced columns of a batch of members from all its columns. Unreplaced
            columns are 1 (`status` and `convergence`: 0); `run` has the numbers of the members.
        plan_keys: Other keys of the plan.
    """
    plan = load_plan({"title": "Made up", "base": plain(VISCO_ELASTIC), "vary": vary} | plan_keys)
    layout = varied_layout(plan) | columns_of(plan) | GATHERED_COLUMNS
    attributes: dict[str, str | int | float] = {
        "title": plan.title,
        "plan_id": "0" * 32,
        "engine": "scipy",
        "design": plan.design.keyword if plan.design else "grid",
        "checked_members": 0,
        "checked_unlike": 0,
        "created": "2026-01-01",
        "rbstab_version": "0",
    }
    text = np.array(plan_yaml(plan), dtype=object)
    extras = grid_extras(plan) | {"plan": Variable((), text, "", "plan")}
    path.parent.mkdir(parents=True, exist_ok=True)
    head = TableHeader(layout, 0, plan.members, attributes, extras)
    write_table(path, head, _batches(plan, columns))
    return SweepFile(0, "sweep-1", path.parent.name, path)


def _batches(plan: Plan, columns: Columns) -> Iterator[dict[str, Any]]:
    for start in range(0, plan.members, BATCH_SIZE):
        stop = min(start + BATCH_SIZE, plan.members)
        arrays = varied_arrays(plan, start, stop)
        for name, column in columns_of(plan).items():
            arrays[name] = np.ones((stop - start, *column.shape), dtype=column.dtype)
        arrays["run_id"][:] = b"0123456789abcdef" * 2
        arrays["status"][:] = 0
        for name, column in GATHERED_COLUMNS.items():
            arrays[name] = np.zeros(stop - start, column.dtype)
        given = columns(arrays | {"run": np.arange(start, stop)})
        yield arrays | {k: np.asarray(v).astype(arrays[k].dtype) for k, v in given.items()}
