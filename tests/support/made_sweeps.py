"""Sweeps with made up members, written by the store from a real plan."""

from collections.abc import Callable
from typing import Any

import numpy as np

from rbstab.integrate.status import RunStatus
from rbstab.report.reading.sources import SweepFile
from rbstab.store.dataset_file import write_dataset
from rbstab.store.table import Table, columns_from
from rbstab.store.variables import RUN
from rbstab.sweep.folder.members_file import plan_variables, varied_columns
from rbstab.sweep.folder.open_folder import open_folder
from rbstab.sweep.folder.sweep_table import MEMBERS, digest_of_all
from rbstab.sweep.members.engine import Shard
from rbstab.sweep.members.outcome import STATUSES, columns_of
from rbstab.sweep.plan.load import load_plan
from rbstab.sweep.plan.plan import plan_id
from rbstab.sweep.proofs.columns import CONVERGENCE_COLUMNS
from support.configs import VISCO_ELASTIC, plain

SPIN = "initial.angular_velocity"

GRID = {f"{SPIN}[0]": {"linspace": [-2, 2, 5]}, f"{SPIN}[1]": {"linspace": [0, 30, 4]}}
"""20 members: five spins about the first axis, four about the second; the second varies fastest."""

Columns = Callable[[dict[str, Any]], dict[str, Any]]


def code(status):
    """Return the code of a status in a file."""
    return STATUSES.index(RunStatus(status))


def write_sweep(path, vary, columns=lambda _: {}, **plan_keys):
    """Write a sweep and return it as a source of a report.

    Args:
        path: Its members file.
        vary: The key `vary` of the plan.
        columns: Returns replaced columns from all columns. Unreplaced columns are 1 (`status`,
            `convergence` and the orientations at rest and at the end: 0); `run` has the numbers of
            the members.
        plan_keys: Other keys of the plan.
    """
    plan = load_plan({"title": "Made up", "base": plain(VISCO_ELASTIC), "vary": vary} | plan_keys)
    attributes: dict[str, str | int | float] = {
        "title": plan.title,
        "plan_id": plan_id(plan),
        "engine": "scipy",
        "design": plan.design.keyword if plan.design else "grid",
        "checked_members": 0,
        "checked_unlike": 0,
        "created": "2026-01-01",
        "rbstab_version": "0",
    }
    arrays = _arrays(plan, columns)
    with open_folder(path.parent, plan, 1 + plan.members // 2, force=True) as opened:
        folder = opened.folder
        for number in range(folder.shards):
            members = slice(*folder.bounds(number))
            outcome = {name: arrays[name][members] for name in folder.manifest.columns}
            folder.write(plan, number, Shard(outcome))
        digests = [folder.read(number).digest for number in range(folder.shards)]
        attributes["shards_digest"] = digest_of_all(digests)
    varied = varied_columns(plan, 0, plan.members)
    varied = {name: variable._replace(data=arrays[name]) for name, variable in varied.items()}
    convergence = columns_from(CONVERGENCE_COLUMNS, arrays)
    variables = {RUN: convergence[RUN], **varied, **convergence, **plan_variables(plan)}
    write_dataset(path, Table(variables, attributes, kind=MEMBERS), replace=True)
    return SweepFile(0, "sweep-1", path.parent.name, path)


def _arrays(plan, columns):
    varied = varied_columns(plan, 0, plan.members)
    arrays = {name: variable.data for name, variable in varied.items()} | {
        RUN: np.arange(plan.members)
    }
    for name, column in columns_of(plan).items():
        arrays[name] = np.ones((plan.members, *column.shape), dtype=column.dtype)
    for name in ("status", "rest_orientation", "rest_unstable", "final_orientation"):
        if name in arrays:
            arrays[name][:] = 0
    for name, column in CONVERGENCE_COLUMNS.items():
        arrays[name] = np.zeros(plan.members, column.dtype)
    given = columns(arrays)
    return arrays | {k: np.asarray(v).astype(arrays[k].dtype) for k, v in given.items()}
