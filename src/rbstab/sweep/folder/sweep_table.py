"""The table of all members of a finished sweep, read from its shards and its members file."""

import hashlib
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np

from rbstab.store.disk.paths import path_exists, path_is_dir
from rbstab.store.errors import NotAResultError
from rbstab.store.table import Table, read_table
from rbstab.store.variables import RUN
from rbstab.sweep.folder.manifest import MANIFEST
from rbstab.sweep.folder.sweep_folder import SweepFolder, read_folder, unfinished_error
from rbstab.sweep.proofs.columns import CONVERGENCE_COLUMNS

MEMBERS = "what is known of the members of a sweep"
"""The kind of the members file: the varied values, what is proved of each member, the plan."""


def read_sweep(path: Path, names: Iterable[str] | None = None) -> Table:
    """Read columns of all members of a finished sweep.

    Args:
        path: The folder of the sweep, or its members file.
        names: The columns; default all.

    Raises:
        NotAResultError: A file is damaged, or is not of a sweep.
        NewerSchemaError: A file was written by a newer rbstab.
        StoreError: A file cannot be opened, or the sweep is not finished.
    """
    folder = read_folder(path if path_is_dir(path) else _folder_of(path))
    if not path_exists(folder.sweep_file):
        raise unfinished_error(folder)
    wanted = None if names is None else set(names)
    table = read_members_file(folder, wanted)
    columns = [name for name in folder.manifest.columns if wanted is None or name in wanted]
    if not columns:
        return table
    shards = [folder.read(number, columns) for number in range(folder.shards)]
    _check_digest(folder, table, shards)
    outcomes = {
        name: shards[0].variables[name]._replace(data=np.concatenate([s[name] for s in shards]))
        for name in columns
    }
    varied = {name: table.variables[name] for name in table.varied if name in table}
    first = {RUN: table.variables[RUN], **varied, **outcomes}
    # What is known of a member now may be more than its shard says.
    return replace(table, variables=first | dict(table.variables))


def read_members_file(folder: SweepFolder, names: Iterable[str] | None = None) -> Table:
    """Read columns of the members file of a finished sweep.

    Args:
        folder: The folder.
        names: The columns; default all.

    Raises:
        NotAResultError: It is damaged, or is that of another sweep.
        NewerSchemaError: It was written by a newer rbstab.
        StoreError: It cannot be opened.
    """
    wanted = None if names is None else set(names)
    table, manifest = read_table(folder.sweep_file, MEMBERS, wanted), folder.manifest
    fits = table.attributes.get("plan_id") == manifest.plan_id
    fits = fits and len(table[RUN]) == manifest.members and table[RUN][0] == 0
    fits = fits and all(table[name].ndim == 1 for name in table.columns)
    for name, column in CONVERGENCE_COLUMNS.items():
        if wanted is None or name in wanted:
            fits = fits and name in table and column.describes(table.variables[name])
    if not fits:
        raise NotAResultError(f"{folder.sweep_file} is not the members file of this sweep")
    return table


def _folder_of(file: Path) -> Path:
    """Return the folder of a members file; of another file, the error says what is wrong."""
    if not path_exists(file.parent / MANIFEST):
        read_table(file, MEMBERS, ())
        raise NotAResultError(f"{file} lacks the rest of its sweep: open the folder of a sweep")
    return file.parent


def check_sweep(file: Path) -> None:
    """Read all files of a finished sweep, but its traces, and compare them with their seals.

    Args:
        file: Its members file.

    Raises:
        StoreError: As `read_sweep`.
    """
    folder = read_folder(file.parent)
    table = read_members_file(folder)
    _check_digest(folder, table, (folder.read(number) for number in range(folder.shards)))


def digest_of_all(digests: Iterable[str]) -> str:
    """Return the digest of all shards of a sweep, from that of each."""
    return hashlib.sha256(" ".join(digests).encode()).hexdigest()


def _check_digest(folder: SweepFolder, table: Table, shards: Iterable[Table]) -> None:
    """Refuse a members file of other shards: an interrupted `--retry-failed` leaves one."""
    if table.attributes.get("shards_digest") != digest_of_all(shard.digest for shard in shards):
        raise unfinished_error(folder)


def open_sweep(path: str | Path) -> Table:
    """Read a finished sweep from its folder; see `rbstab.open_sweep`.

    Raises:
        NotAResultError: The file is damaged, or is not a sweep.
        NewerSchemaError: The file was written by a newer rbstab.
        StoreError: The file cannot be opened, or the sweep is not finished.
    """
    # Imported late: it needs the plan, and much of the program.
    from rbstab.sweep.folder.outcomes import plan_of, with_outcomes
    from rbstab.sweep.proofs.disturbed import COLUMN, member_bounds

    table, place = read_sweep(Path(path)), Path(path).absolute()
    plan, folder = plan_of(table), place if path_is_dir(place) else place.parent
    table, bounds = with_outcomes(table, plan), plan and member_bounds(plan, folder.parent)
    stated_bounds = {"stated_bound": COLUMN.of(bounds.codes)} if bounds else {}
    return replace(table, variables=dict(table.variables) | stated_bounds)
