"""Beginning a sweep, or going on with it, in a folder that only parts of it share."""

import os
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import asdict
from pathlib import Path
from typing import NamedTuple

from rbstab.experiment.provenance import provenance
from rbstab.store.atomic import PARTIAL, remove_partial_files, write_atomically
from rbstab.store.document import write_document
from rbstab.store.errors import NotAResultError, ResultExistsError, StoreError
from rbstab.store.lock import LOCK, FolderInUseError, locked
from rbstab.store.presence import path_exists
from rbstab.sweep.folder.disk_space import trace_size
from rbstab.sweep.folder.parts import Part, running_parts
from rbstab.sweep.folder.sweep_folder import (
    MANIFEST,
    PLAN_FILE,
    SHARDS,
    TRACES,
    Manifest,
    SweepFolder,
    read_folder,
)
from rbstab.sweep.plan.dump import plan_yaml
from rbstab.sweep.plan.plan import Plan, plan_id
from rbstab.sweep.plan.trace_selection import SUMMARY

_NOT_OVERWRITTEN = "it is not overwritten: choose another folder with -o, or move it aside"

MAX_WRITE_TIME = 3600.0
"""s after which a temporary file in a folder that parts share is taken for that of a killed one."""


class OpenFolder(NamedTuple):
    """The folder of a sweep, open for writing.

    moved_aside is where a different sweep of the same name was moved, if there was one;
    changed_versions are the versions that differ from those that the sweep was started with.
    """

    folder: SweepFolder
    moved_aside: Path | None
    changed_versions: tuple[str, ...]


@contextmanager
def open_for_sweep(
    path: Path, plan: Plan, shard_size: int | None, *, force: bool = False
) -> Iterator[OpenFolder]:
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
    fixed = shard_size is not None
    while True:
        with locked_folder(path) as sure:
            different = _difference(path, wanted, fixed_size=fixed)
            if different is None:
                folder = _ready(path, plan, wanted, fixed_size=fixed)
                if sure:
                    remove_old_partial_files(path)
                yield OpenFolder(folder, aside, _changed(path, wanted))
                return
            if not force:
                raise ResultExistsError(f"{path} {different}; {_NOT_OVERWRITTEN} with --force")
            if os.name != "nt":
                aside = _move_aside(path)
        if os.name == "nt":
            # No folder is moved there that has an open file, as is the lock.
            aside = _move_aside(path)


@contextmanager
def open_for_part(
    path: Path, plan: Plan, shard_size: int | None, part: Part
) -> Iterator[OpenFolder]:
    """The folder of a plan for one of its parts, which shares it with the others.

    Raises:
        FolderInUseError: A whole sweep is at it, or this part, by another process.
        ResultExistsError: A different sweep has that name.
        StoreError: The folder cannot be written.
    """
    wanted = _manifest(plan, shard_size)
    fixed = shard_size is not None
    with locked_folder(path, part):
        different = _difference(path, wanted, fixed_size=fixed)
        if different is not None:
            raise ResultExistsError(f"{path} {different}; {_NOT_OVERWRITTEN}")
        folder = _ready(path, plan, wanted, fixed_size=fixed)
        yield OpenFolder(folder, None, _changed(path, wanted))


def planned_folder(
    path: Path, plan: Plan, shard_size: int | None
) -> tuple[SweepFolder, bool | None]:
    """The folder that a plan has or will have, and whether it was begun; nothing is written.

    Returns:
        The folder, and True where it was begun, False where another sweep has its name, None where
        nothing has.

    Raises:
        StoreError: What is there cannot be read.
    """
    planned = SweepFolder(path, _manifest(plan, shard_size))
    if not path_exists(path / MANIFEST):
        return planned, None
    found = read_folder(path)
    same = found.manifest.plan_id == planned.manifest.plan_id
    return (found if same else planned), same


MAX_TRACE_BYTES = 32e6
"""Bytes of the traces of a shard, which are in memory, once for each thread."""


def good_shard_size(members: int, *, one_by_one: bool, trace_bytes: float = 0.0) -> int:
    """Members of a shard: few enough that little is lost and all threads have work, yet thousands.

    It does not depend on the number of threads. Engines like multiples of 64.

    Args:
        members: Of the sweep.
        one_by_one: Whether any of them are followed by themselves, which takes much longer.
        trace_bytes: What is kept of the motion of a member, on average.
    """
    most = max(1, int(MAX_TRACE_BYTES / trace_bytes)) if trace_bytes else 4096
    if one_by_one:
        return min(16, most)
    size = min(4096, max(1024, members // 64 // 64 * 64), most)
    return size // 64 * 64 or size


def _manifest(plan: Plan, shard_size: int | None) -> Manifest:
    share = plan.keep.count(plan.members) / plan.members
    one_by_one = plan.engine == "scipy" or "sliding" in plan.variants
    size = shard_size or good_shard_size(
        plan.members, one_by_one=one_by_one, trace_bytes=share * trace_size(plan)
    )
    known = provenance(plan.engine)
    versions = {name: known[name] for name in known if name not in ("created", "commit")}
    return Manifest(plan_id(plan), plan.title, plan.members, size, plan.engine, versions, plan.keep)


@contextmanager
def locked_folder(path: Path, part: Part | None = None) -> Iterator[bool]:
    """The folder, made and locked: for this process alone, or for a part beside other parts.

    Yields:
        Whether the file system knows locks.

    Raises:
        FolderInUseError: Another process is at it.
        StoreError: The folder cannot be written.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StoreError(f"{path} cannot be written: {error.strerror or error}") from error
    with ExitStack() as locks:
        try:
            sure = locks.enter_context(locked(path, shared=part is not None))
            if part is not None:
                sure = locks.enter_context(locked(path, part.lock))
        except FolderInUseError as error:
            raise FolderInUseError(f"{error}{_by_parts(path)}") from error
        yield sure


def _by_parts(path: Path) -> str:
    running = running_parts(path)
    return f" (running: part {', '.join(map(str, running))})" if running else ""


def _difference(path: Path, wanted: Manifest, *, fixed_size: bool) -> str | None:
    """What keeps the sweep from going on in a folder."""
    if not path_exists(path / MANIFEST):
        names = [f.name for f in path.iterdir() if f.name not in (PLAN_FILE, SHARDS, TRACES)]
        strange = [n for n in names if not n.startswith(LOCK) and not n.endswith(PARTIAL)]
        return f"holds other things ({min(strange)})" if strange else None
    try:
        found = read_folder(path).manifest
    except NotAResultError as error:
        return f"cannot be gone on with ({error})"
    if found.plan_id != wanted.plan_id:
        return f"holds another sweep (plan {found.plan_id[:8]}, not {wanted.plan_id[:8]})"
    if fixed_size and found.shard_size != wanted.shard_size:
        return f"was begun with shards of {found.shard_size} members"
    return None


def _changed(path: Path, new: Manifest) -> tuple[str, ...]:
    """The versions that are not those with which the sweep was begun, in words."""
    old = read_folder(path).manifest
    return tuple(
        f"{name.removesuffix('_version')} {old.versions.get(name, '?')} -> {version}"
        for name, version in new.versions.items()
        if old.versions.get(name) != version
    )


def _ready(path: Path, plan: Plan, manifest: Manifest, *, fixed_size: bool) -> SweepFolder:
    """The folder with all that belongs there.

    Others may be making it at the same time, of the same plan: the first manifest counts.
    """
    begins = not path_exists(path / MANIFEST)
    try:
        for name in (SHARDS, TRACES)[: 2 if manifest.keep != SUMMARY else 1]:
            (path / name).mkdir(exist_ok=True)
        text = plan_yaml(plan).encode()
        if _content(path / PLAN_FILE) != text:
            write_atomically(path / PLAN_FILE, text, replace=True)
    except OSError as error:
        raise StoreError(f"{path} cannot be written: {error.strerror or error}") from error
    if begins:
        # The last thing: without it the folder counts as empty.
        with suppress(ResultExistsError):
            write_document(path / MANIFEST, asdict(manifest), replace=False)
        different = _difference(path, manifest, fixed_size=fixed_size)
        if different is not None:
            raise ResultExistsError(f"{path} {different}, by another process in this instant")
    return read_folder(path)


def _content(path: Path) -> bytes | None:
    with suppress(OSError):
        return path.read_bytes()
    return None


def remove_old_partial_files(path: Path) -> None:
    """Removes what killed processes have left in a folder; its lock must be held alone.

    Where parts have been at work, some locks may be known on one machine only, and what a part on
    another one is writing must stay.
    """
    shared = any(path.glob(f"{LOCK}.*"))
    for place in (path, path / SHARDS, path / TRACES):
        remove_partial_files(place, MAX_WRITE_TIME if shared else 0.0)


def _move_aside(path: Path) -> Path:
    try:
        middle = read_folder(path).manifest.plan_id[:8]
    except StoreError:
        middle = "damaged"
    names = [path.with_name(f"{path.name}.{middle}")]
    while names[-1].exists():
        names.append(path.with_name(f"{path.name}.{middle}-{len(names)}"))
    try:
        return path.rename(names[-1])
    except OSError as error:
        raise StoreError(f"{path} cannot be moved: {error.strerror or error}") from error
