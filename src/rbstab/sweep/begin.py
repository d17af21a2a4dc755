"""Beginning a sweep, or going on with it, in a folder that nobody else writes to meanwhile."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import NamedTuple

from rbstab.experiment.provenance import provenance
from rbstab.store.atomic import PARTIAL, remove_remains, write_whole
from rbstab.store.document import write_document
from rbstab.store.errors import NotAResultError, ResultExistsError, StoreError
from rbstab.store.lock import LOCK, locked
from rbstab.sweep.dump import plan_yaml
from rbstab.sweep.folder import (
    MANIFEST,
    PLAN_FILE,
    SHARDS,
    TRACES,
    Manifest,
    SweepFolder,
    open_folder,
)
from rbstab.sweep.keep import SUMMARY
from rbstab.sweep.plan import Plan, plan_id
from rbstab.sweep.room import trace_size


class Begun(NamedTuple):
    """A folder in which a sweep may go on.

    kept_aside is where another sweep of its name went, if there was one; changed says which
    versions are not those with which the sweep was begun.
    """

    folder: SweepFolder
    kept_aside: Path | None
    changed: tuple[str, ...]


@contextmanager
def begun(
    path: Path, plan: Plan, shard_size: int | None, *, force: bool = False
) -> Iterator[Begun]:
    """The folder of a plan, made where it is not there, and locked.

    Args:
        path: The folder.
        plan: The plan.
        shard_size: Members of a shard; default that of the folder, or a good one.
        force: Move a different sweep of that name aside.

    Raises:
        FolderInUseError: Another process is at it.
        ResultExistsError: A different sweep has that name (without `force`).
        StoreError: The folder cannot be written.
    """
    aside = None
    wanted = _manifest(plan, shard_size)
    while True:
        with _made(path):
            different = _difference(path, wanted, fixed_size=shard_size is not None)
            if different is None:
                yield Begun(_ready(path, plan, wanted), aside, _changed(path, wanted))
                return
            if not force:
                raise ResultExistsError(
                    f"{path} {different}; it is not overwritten: "
                    "choose another folder with -o, or move it aside with --force"
                )
            if os.name != "nt":
                aside = _set_aside(path)
        if os.name == "nt":
            # No folder is moved there that has an open file, as is the lock.
            aside = _set_aside(path)


LARGEST_TRACES = 1 << 26
"""Bytes of the traces of a shard, which are in memory, once for each thread."""


def good_shard_size(members: int, engine: str, trace_bytes: float = 0.0) -> int:
    """Members of a shard: few enough that little is lost and all threads have work, yet thousands.

    It does not depend on the number of threads. Engines like multiples of 64.

    Args:
        members: Of the sweep.
        engine: What follows them.
        trace_bytes: What is kept of the motion of a member, on average.
    """
    most = max(1, int(LARGEST_TRACES / trace_bytes)) if trace_bytes else 4096
    if engine == "scipy":
        return min(16, most)
    size = min(4096, max(256, members // 64 // 64 * 64), most)
    return size // 64 * 64 or size


def _manifest(plan: Plan, shard_size: int | None) -> Manifest:
    share = plan.keep.count(plan.members) / plan.members
    size = shard_size or good_shard_size(plan.members, plan.engine, share * trace_size(plan))
    known = provenance(plan.engine)
    versions = {name: known[name] for name in known if name not in ("created", "commit")}
    return Manifest(plan_id(plan), plan.title, plan.members, size, plan.engine, versions, plan.keep)


@contextmanager
def _made(path: Path) -> Iterator[None]:
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StoreError(f"{path} cannot be written: {error.strerror or error}") from error
    with locked(path):
        yield


def _difference(path: Path, wanted: Manifest, *, fixed_size: bool) -> str | None:
    """What keeps the sweep from going on in a folder."""
    if not (path / MANIFEST).exists():
        harmless = (LOCK, PLAN_FILE, SHARDS, TRACES)
        strange = [f.name for f in path.iterdir() if f.name not in harmless]
        strange = [name for name in strange if not name.endswith(PARTIAL)]
        return f"holds other things ({min(strange)})" if strange else None
    try:
        found = open_folder(path).manifest
    except NotAResultError as error:
        return f"cannot be gone on with ({error})"
    if found.plan_id != wanted.plan_id:
        return f"holds another sweep (plan {found.plan_id[:8]}, not {wanted.plan_id[:8]})"
    if fixed_size and found.shard_size != wanted.shard_size:
        return f"was begun with shards of {found.shard_size} members"
    return None


def _changed(path: Path, new: Manifest) -> tuple[str, ...]:
    """The versions that are not those with which the sweep was begun, in words."""
    old = open_folder(path).manifest
    return tuple(
        f"{name.removesuffix('_version')} {old.versions.get(name, '?')} -> {version}"
        for name, version in new.versions.items()
        if old.versions.get(name) != version
    )


def _ready(path: Path, plan: Plan, manifest: Manifest) -> SweepFolder:
    """The folder with all that belongs there, and nothing that a killed process has left."""
    begins = not (path / MANIFEST).exists()
    try:
        for name in (SHARDS, TRACES)[: 2 if manifest.keep != SUMMARY else 1]:
            (path / name).mkdir(exist_ok=True)
        if begins or not (path / PLAN_FILE).exists():
            write_whole(path / PLAN_FILE, plan_yaml(plan).encode(), replace=True)
    except OSError as error:
        raise StoreError(f"{path} cannot be written: {error.strerror or error}") from error
    if begins:
        # The last thing: without it the folder counts as empty.
        write_document(path / MANIFEST, asdict(manifest))
    for place in (path, path / SHARDS, path / TRACES):
        remove_remains(place)
    return open_folder(path)


def _set_aside(path: Path) -> Path:
    try:
        middle = open_folder(path).manifest.plan_id[:8]
    except StoreError:
        middle = "damaged"
    names = [path.with_name(f"{path.name}.{middle}")]
    while names[-1].exists():
        names.append(path.with_name(f"{path.name}.{middle}-{len(names)}"))
    try:
        return path.rename(names[-1])
    except OSError as error:
        raise StoreError(f"{path} cannot be moved: {error.strerror or error}") from error
