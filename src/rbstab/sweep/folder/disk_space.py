"""What a sweep takes on the disk, and whether it is there."""

import shutil
from collections.abc import Iterable

from rbstab.store.errors import StoreError
from rbstab.sweep.folder.layout import OUTCOME, varied_layout
from rbstab.sweep.folder.sweep_folder import SweepFolder
from rbstab.sweep.members.traces import layout_of
from rbstab.sweep.plan.plan import Plan

_NUMBER = 8
"""Bytes of the number of a member."""


def sweep_bytes(plan: Plan) -> int:
    """What a sweep takes on the disk: its shards, their traces, and the file that gathers them."""
    traces = plan.keep.count(plan.members)
    return plan.members * (_of_shard() + _gathered(plan)) + traces * trace_size(plan)


def trace_size(plan: Plan) -> int:
    """The bytes of a trace; 0 where the plan keeps none."""
    return layout_of(plan).size + _NUMBER if plan.keep.count(plan.members) else 0


def check_disk_space(plan: Plan, folder: SweepFolder, missing: Iterable[int]) -> None:
    """Makes sure that the disk has room for what is still to be written.

    Args:
        plan: The plan.
        folder: The folder.
        missing: Shards.

    Raises:
        StoreError: It clearly has not.
    """
    bounds = [folder.bounds(number) for number in missing]
    if not bounds:
        return
    needed = plan.members * _gathered(plan) + sum(b - a for a, b in bounds) * _of_shard()
    each = trace_size(plan)
    if each:
        needed += each * sum(int(plan.keep.traces(*bound).sum()) for bound in bounds)
    free = shutil.disk_usage(folder.path).free
    if free < needed:
        raise StoreError(
            f"{folder.path} needs {needed / 1e9:.3g} GB more, and {free / 1e9:.3g} GB are free: "
            "nothing was begun"
        )


def _of_shard() -> int:
    return sum(column.size for column in OUTCOME.values()) + _NUMBER


def _gathered(plan: Plan) -> int:
    return _of_shard() + sum(column.size for column in varied_layout(plan).values())
