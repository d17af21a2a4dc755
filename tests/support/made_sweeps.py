"""Files of sweeps whose members are made up, written by the store from a real plan."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from rbstab.integrate.status import RunStatus
from rbstab.report.reading.sources import SweepFile
from rbstab.store.result import Variable
from rbstab.store.table import Head
from rbstab.store.table_file import write_table
from rbstab.sweep.folder.layout import OUTCOME, grid_extras, varied_arrays, varied_layout
from rbstab.sweep.members.convergence import COLUMN
from rbstab.sweep.members.outcome import STATUSES
from rbstab.sweep.plan.dump import plan_yaml
from rbstab.sweep.plan.load import load_plan
from rbstab.sweep.plan.plan import Plan
from support.configs import VISCO_ELASTIC, plain

SPIN = "initial.angular_velocity"

GRID = {f"{SPIN}[0]": {"linspace": [-2, 2, 5]}, f"{SPIN}[1]": {"linspace": [0, 30, 4]}}
"""20 members: five spins about the first axis, four about the second, which is the fastest."""

Columns = Callable[[dict[str, Any]], dict[str, Any]]

BLOCK = 1 << 16


def code(status: str) -> int:
    """The code of a status in a file."""
    return STATUSES.index(RunStatus(status))


def write_sweep(
    path: Path, vary: dict[str, Any], columns: Columns = lambda _: {}, **plan_keys: Any
) -> SweepFile:
    """Writes a sweep.

    Args:
        path: The file.
        vary: What the plan varies.
        columns: Gives columns of some members from their other columns, which are all 1 (`status`
            and `convergence`: 0), and from what is varied; `run` has their numbers.
        plan_keys: Other keys of the plan.
    """
    plan = load_plan({"title": "Made up", "base": plain(VISCO_ELASTIC), "vary": vary} | plan_keys)
    layout = varied_layout(plan) | OUTCOME | {"convergence": COLUMN}
    attributes = {
        "title": plan.title,
        "plan_id": "0" * 32,
        "engine": "scipy",
        "design": plan.design.word if plan.design else "grid",
        "checked_members": 0,
        "checked_unlike": 0,
        "created": "2026-01-01",
        "rbstab_version": "0",
    }
    text = np.array(plan_yaml(plan), dtype=object)
    extras = grid_extras(plan) | {"plan": Variable((), text, "", "plan")}
    path.parent.mkdir(parents=True, exist_ok=True)
    head = Head(layout, 0, plan.members, attributes, extras)
    write_table(path, head, _parts(plan, columns))
    return SweepFile(0, "sweep-1", path.parent.name, path)


def _parts(plan: Plan, columns: Columns) -> Iterator[dict[str, Any]]:
    for start in range(0, plan.members, BLOCK):
        stop = min(start + BLOCK, plan.members)
        arrays = varied_arrays(plan, start, stop)
        for name, column in OUTCOME.items():
            arrays[name] = np.ones((stop - start, *column.shape), dtype=column.dtype)
        arrays["run_id"][:] = b"0123456789abcdef" * 2
        arrays["status"][:] = 0
        arrays["convergence"] = np.zeros(stop - start, "i1")
        given = columns(arrays | {"run": np.arange(start, stop)})
        yield arrays | {k: np.asarray(v).astype(arrays[k].dtype) for k, v in given.items()}
