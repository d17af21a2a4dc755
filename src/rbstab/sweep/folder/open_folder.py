"""Start or resume a sweep in its folder, locked for one process or for the parts of a sweep."""

import os
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import NamedTuple

from rbstab.experiment.provenance import provenance
from rbstab.store.disk.atomic import PARTIAL_SUFFIX, remove_partial_files, write_atomically
from rbstab.store.disk.existence import path_exists
from rbstab.store.disk.lock import LOCK_FILE, FolderInUseError, locked
from rbstab.store.disk.regular_file import read_regular
from rbstab.store.document import write_document
from rbstab.store.errors import NotAResultError, ResultExistsError, StoreError
from rbstab.sweep.folder.disk_space import trace_size
from rbstab.sweep.folder.manifest import MANIFEST, MAX_SHARDS, Manifest, StoredState
from rbstab.sweep.folder.parts import Part, running_parts
from rbstab.sweep.folder.sweep_folder import (
    PLAN_FILE,
    SHARDS,
    TRACES,
    SweepFolder,
    read_folder,
)
from rbstab.sweep.members.outcome import columns_of, element_states
from rbstab.sweep.plan.dump import plan_yaml
from rbstab.sweep.plan.plan import MAX_MEMBERS, Plan, plan_id
from rbstab.sweep.plan.trace_selection import NO_TRACES
from rbstab.sweep.proofs.convergence import shares_proof
from rbstab.systems.modes import has_modes

_NOT_OVERWRITTEN = "it is not overwritten. Choose another folder with -o, or move it aside"

MAX_WRITE_TIME = 3600.0
"""s; an older temporary file in a folder of parts is treated as left by a killed process."""


class OpenFolder(NamedTuple):
    """The folder of a sweep, open for writing.

    Args:
        folder: The folder.
        moved_aside: The new path of a different sweep of the same name, if there was one.
        changed_versions: The versions that have changed since the sweep was started.
    """

    folder: SweepFolder
    moved_aside: Path | None
    changed_versions: tuple[str, ...]


@contextmanager
def open_for_sweep(
    path: Path, plan: Plan, shard_size: int | None, *, force: bool = False
) -> Iterator[OpenFolder]:
    """Open and lock the folder of a plan; make it if it does not exist.

    Args:
        path: The folder.
        plan: The plan.
        shard_size: Members per shard; default the size used in the folder, or else computed.
        force: Rename the folder if it has a different sweep or other files.

    Yields:
        The folder, locked until the context ends.

    Raises:
        FolderInUseError: Another process is writing to the folder.
        ResultExistsError: The folder has a different sweep or other files (without `force`).
        StoreError: The folder cannot be written.
    """
    moved_aside = None
    wanted = _manifest(plan, shard_size)
    fixed = shard_size is not None
    while True:
        with locked_folder(path) as locks_supported:
            conflict = _conflict(path, wanted, fixed_size=fixed)
            if conflict is None:
                folder = _prepare_folder(path, plan, wanted, fixed_size=fixed)
                if locks_supported:
                    remove_old_partial_files(path)
                yield OpenFolder(folder, moved_aside, _changed_versions(path, wanted))
                return
            if not force:
                raise ResultExistsError(f"{path} {conflict}; {_NOT_OVERWRITTEN} with --force")
            if os.name != "nt":
                moved_aside = _move_aside(path)
        if os.name == "nt":
            # Windows cannot move a folder with an open file, such as the lock.
            moved_aside = _move_aside(path)


@contextmanager
def open_for_part(
    path: Path, plan: Plan, shard_size: int | None, part: Part
) -> Iterator[OpenFolder]:
    """Open and lock the folder of a plan for one part; other parts may use it at the same time.

    Args:
        path: The folder.
        plan: The plan.
        shard_size: Members per shard; default the size used in the folder, or else computed.
        part: The part.

    Yields:
        The folder, locked until the context ends.

    Raises:
        FolderInUseError: Another process runs the whole sweep, or this part.
        ResultExistsError: The folder has a different sweep or other files.
        StoreError: The folder cannot be written.
    """
    wanted = _manifest(plan, shard_size)
    fixed = shard_size is not None
    with locked_folder(path, part):
        conflict = _conflict(path, wanted, fixed_size=fixed)
        if conflict is not None:
            raise ResultExistsError(f"{path} {conflict}; {_NOT_OVERWRITTEN}")
        folder = _prepare_folder(path, plan, wanted, fixed_size=fixed)
        yield OpenFolder(folder, None, _changed_versions(path, wanted))


def planned_folder(
    path: Path, plan: Plan, shard_size: int | None
) -> tuple[SweepFolder, bool | None]:
    """Return the folder of a plan, and whether its sweep was started, without writing.

    Args:
        path: The folder.
        plan: The plan.
        shard_size: Members per shard; default the size used in the folder, or else computed.

    Returns:
        The folder, and True if the sweep was started, False if the folder holds another sweep, None
        if it holds no sweep.

    Raises:
        StoreError: The folder cannot be read.
    """
    planned = SweepFolder(path, _manifest(plan, shard_size))
    if not path_exists(path / MANIFEST):
        return planned, None
    found = read_folder(path)
    same = found.manifest.plan_id == planned.manifest.plan_id
    if same and not found.manifest.fits(plan):
        raise NotAResultError(f"{path / MANIFEST} is damaged: it does not fit its plan")
    return (found if same else planned), same


MAX_TRACE_BYTES = 32e6
"""Bytes of the traces of a shard. Each thread has one shard in memory."""


MAX_PROOFS = 16
"""Members of a shard whose motions are enclosed one by one, on average. Each takes about a second.
"""

MAX_JOINT_PROOFS = 256
"""Members of a shard whose motions are enclosed together, on average. They take some ten seconds.
"""


def default_shard_size(
    members: int, *, one_by_one: bool, trace_bytes: float = 0.0, shard_limit: int = 4096
) -> int:
    """Return the default number of members of a shard.

    If a process dies, little work is lost with small shards; they also give work to all threads.
    Large shards, of thousands of members, are computed faster. The size does not depend on the
    number of threads. It is a multiple of 64 where possible, because engines compute such batches
    fastest.

    Args:
        members: The number of members of the sweep.
        one_by_one: Some members run one by one, which takes much longer.
        trace_bytes: The bytes of traces per member, on average.
        shard_limit: The most members of a shard, because of their proofs.
    """
    limit = max(1, int(MAX_TRACE_BYTES / trace_bytes)) if trace_bytes else 4096
    limit = min(limit, shard_limit)
    if one_by_one:
        return min(16, limit)
    size = min(4096, max(1024, members // 64 // 64 * 64), limit)
    return size // 64 * 64 or size


def _proof_limit(plan: Plan) -> int:
    """Return the most members of a shard, so that their proofs take some ten seconds."""
    if plan.prove is None:
        return MAX_MEMBERS
    share = plan.prove.count(plan.members) / plan.members
    together = all(shares_proof(plan, variant) for variant in plan.variants)
    return max(1, int((MAX_JOINT_PROOFS if together else MAX_PROOFS) / share))


def _manifest(plan: Plan, shard_size: int | None) -> Manifest:
    share = plan.keep.count(plan.members) / plan.members
    problems = plan.initial_value_problems.values()
    one_by_one = plan.engine == "scipy" or any(
        problem.switching is not None or problem.schedule is not None or has_modes(problem.system)
        for problem in problems
    )
    smallest = -(-plan.members // MAX_SHARDS)
    size = shard_size or max(
        smallest,
        default_shard_size(
            plan.members,
            one_by_one=one_by_one,
            trace_bytes=share * trace_size(plan),
            shard_limit=_proof_limit(plan),
        ),
    )
    if size < smallest:
        raise StoreError(
            f"shards of {size} members would be {-(-plan.members // size)} files, and at most "
            f"{MAX_SHARDS} are supported. Choose shards of at least {smallest} members"
        )
    known = provenance(plan.engine)
    return Manifest(
        plan_id=plan_id(plan),
        title=plan.title,
        members=plan.members,
        shard_size=min(size, MAX_MEMBERS),
        engine=plan.engine,
        versions={name: known[name] for name in known if name not in ("created", "commit")},
        keep=plan.keep,
        columns=tuple(columns_of(plan)),
        own_states=tuple(StoredState(**own._asdict()) for own in element_states(plan)),
    )


@contextmanager
def locked_folder(path: Path, part: Part | None = None) -> Iterator[bool]:
    """Make and lock a folder: for one process, or for a part while other parts may run.

    Args:
        path: The folder.
        part: The part; default the whole sweep.

    Yields:
        Whether the file system supports locks.

    Raises:
        FolderInUseError: Another process is writing to the folder.
        StoreError: The folder cannot be written.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StoreError(f"{path} cannot be written: {error.strerror or error}") from error
    with ExitStack() as locks:
        try:
            supported = locks.enter_context(locked(path, shared=part is not None))
            if part is not None:
                supported = locks.enter_context(locked(path, part.lock))
        except FolderInUseError as error:
            raise FolderInUseError(f"{error}{_running_parts_text(path)}") from error
        yield supported


def _running_parts_text(path: Path) -> str:
    running = running_parts(path)
    return f" (running: part {', '.join(map(str, running))})" if running else ""


def _conflict(path: Path, wanted: Manifest, *, fixed_size: bool) -> str | None:
    """Return the reason why the sweep cannot run in the folder, if any."""
    if not path_exists(path / MANIFEST):
        names = [f.name for f in path.iterdir() if f.name not in (PLAN_FILE, SHARDS, TRACES)]
        foreign = [
            n for n in names if not n.startswith(LOCK_FILE) and not n.endswith(PARTIAL_SUFFIX)
        ]
        return f"holds other files ({min(foreign)})" if foreign else None
    try:
        found = read_folder(path).manifest
    except NotAResultError as error:
        return f"cannot be resumed ({error})"
    if found.plan_id != wanted.plan_id:
        return f"holds another sweep (plan {found.plan_id[:8]}, not {wanted.plan_id[:8]})"
    if not found.fits(wanted):
        return f"cannot be resumed ({path / MANIFEST} is damaged: it does not fit its plan)"
    if fixed_size and min(found.shard_size, MAX_MEMBERS) != wanted.shard_size:
        return f"was started with shards of {found.shard_size} members"
    return None


def _changed_versions(path: Path, new: Manifest) -> tuple[str, ...]:
    """Return, as texts, the versions that have changed since the sweep was started."""
    old = read_folder(path).manifest
    return tuple(
        f"{name.removesuffix('_version')} {old.versions.get(name, '?')} -> {version}"
        for name, version in new.versions.items()
        if old.versions.get(name) != version
    )


def _prepare_folder(path: Path, plan: Plan, manifest: Manifest, *, fixed_size: bool) -> SweepFolder:
    """Write the plan, the manifest and the subfolders that are missing.

    Other processes may do this at the same time. The first manifest that is written is used.
    """
    is_new = not path_exists(path / MANIFEST)
    try:
        for name in (SHARDS, TRACES)[: 2 if manifest.keep != NO_TRACES else 1]:
            (path / name).mkdir(exist_ok=True)
        text = plan_yaml(plan).encode()
        if _read_or_none(path / PLAN_FILE) != text:
            write_atomically(path / PLAN_FILE, text, replace=True)
    except OSError as error:
        raise StoreError(f"{path} cannot be written: {error.strerror or error}") from error
    if is_new:
        # The manifest is written last: without it the folder counts as empty.
        with suppress(ResultExistsError):
            write_document(path / MANIFEST, manifest.as_data(), replace=False)
        conflict = _conflict(path, manifest, fixed_size=fixed_size)
        if conflict is not None:
            raise ResultExistsError(f"{path} {conflict}, by another process at the same time")
    return read_folder(path)


def _read_or_none(path: Path) -> bytes | None:
    with suppress(StoreError):
        return read_regular(path)
    return None


def remove_old_partial_files(path: Path) -> None:
    """Remove the temporary files of killed processes; the caller must hold the lock.

    After parts have run in the folder, only old files are removed. A lock may not be visible on
    other machines, so a part elsewhere may still be writing a newer file.
    """
    shared = any(path.glob(f"{LOCK_FILE}.*"))
    for folder in (path, path / SHARDS, path / TRACES):
        remove_partial_files(folder, MAX_WRITE_TIME if shared else 0.0)


def _move_aside(path: Path) -> Path:
    """Rename a folder after its sweep; one that cannot be read now may be whole, and stays."""
    try:
        suffix = read_folder(path).manifest.plan_id[:8]
    except NotAResultError:
        suffix = "damaged"
    names = [path.with_name(f"{path.name}.{suffix}")]
    while path_exists(names[-1]):
        names.append(path.with_name(f"{path.name}.{suffix}-{len(names)}"))
    try:
        return path.rename(names[-1])
    except OSError as error:
        raise StoreError(f"{path} cannot be moved: {error.strerror or error}") from error
