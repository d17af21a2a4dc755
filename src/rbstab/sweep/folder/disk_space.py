"""Disk space of a sweep: needed and free."""

import shutil
from collections.abc import Iterable

from rbstab.store.errors import StoreError
from rbstab.sweep.folder.layout import varied_layout
from rbstab.sweep.folder.sweep_folder import SweepFolder
from rbstab.sweep.members.outcome import columns_of
from rbstab.sweep.members.traces import layout_of
from rbstab.sweep.plan.plan import Plan
from rbstab.sweep.proofs.columns import KNOWN_COLUMNS

_MEMBER_NUMBER_BYTES = 8


def sweep_bytes(plan: Plan) -> int:
    """Return the size of a sweep in bytes: its shards, their traces, and the members file."""
    traces = plan.keep.count(plan.members)
    return plan.members * (
        _shard_bytes_per_member(plan) + _members_file_bytes(plan)
    ) + traces * trace_size(plan)


def trace_size(plan: Plan) -> int:
    """Return the size of a trace in bytes; 0 if the plan stores no traces."""
    return layout_of(plan).size + _MEMBER_NUMBER_BYTES if plan.keep.count(plan.members) else 0


def check_disk_space(plan: Plan, folder: SweepFolder, missing: Iterable[int]) -> None:
    """Check that the disk has room for the missing shards and the members file.

    Args:
        plan: The plan.
        folder: The folder.
        missing: The numbers of the missing shards.

    Raises:
        StoreError: The disk clearly has too little space.
    """
    bounds = [folder.bounds(number) for number in missing]
    if not bounds:
        return
    needed = plan.members * _members_file_bytes(plan) + sum(
        b - a for a, b in bounds
    ) * _shard_bytes_per_member(plan)
    trace_bytes = trace_size(plan)
    if trace_bytes:
        needed += trace_bytes * sum(int(plan.keep.selected(*bound).sum()) for bound in bounds)
    free = shutil.disk_usage(folder.path).free
    if free < needed:
        raise StoreError(
            f"{folder.path} needs {needed / 1e9:.3g} GB more, and {free / 1e9:.3g} GB are free. "
            "No member was computed; free some space, or choose another folder with -o"
        )


def _shard_bytes_per_member(plan: Plan) -> int:
    return sum(column.size for column in columns_of(plan).values()) + _MEMBER_NUMBER_BYTES


def _members_file_bytes(plan: Plan) -> int:
    """Return the size of the members file, per member."""
    columns = varied_layout(plan) | KNOWN_COLUMNS
    return sum(column.size for column in columns.values()) + _MEMBER_NUMBER_BYTES
