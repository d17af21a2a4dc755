"""Start or resume a sweep in its folder.

The manifest is created exclusively: of several commands that start a sweep at once, one writes it,
and the others go on with it, or are refused if theirs differs. Then each computes shards without
asking the others. All share the lock of the folder. A command that replaces what is stored holds it
alone.
"""

import os
import re
import shutil
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NamedTuple

from rbstab.experiment.provenance import provenance
from rbstab.store.disk.atomic import PARTIAL_SUFFIX, write_atomically
from rbstab.store.disk.lock import LOCK_FILE, locked
from rbstab.store.disk.paths import path_exists, read_regular, store_errors
from rbstab.store.document import write_document
from rbstab.store.errors import NotAResultError, ResultExistsError, StoreError
from rbstab.sweep.folder.manifest import MANIFEST, MAX_SHARDS, Manifest
from rbstab.sweep.folder.members_file import columns_beside_shards
from rbstab.sweep.folder.sweep_folder import PLAN_FILE, SHARDS, TRACES, SweepFolder, read_folder
from rbstab.sweep.members.outcome import columns_of
from rbstab.sweep.members.traces import layout_of
from rbstab.sweep.plan.load import plan_yaml
from rbstab.sweep.plan.plan import MAX_MEMBERS, Plan, plan_id
from rbstab.sweep.plan.plan_file import NO_TRACES
from rbstab.sweep.proofs.variants import shares_proof
from rbstab.systems.modes import has_modes

MEMBER_BYTES = 8
"""The size of the number of a member in a file, and of the value of a varied key."""

MAX_TRACE_BYTES = 32e6
"""Bytes of the traces of a shard. Each thread has one shard in memory."""

MAX_PROOFS = 16
"""Members of a shard whose motions are enclosed one by one, on average. Each takes about a second.
"""

MAX_JOINT_PROOFS = 256
"""Members of a shard whose motions are enclosed together, on average. They take some ten seconds.
"""


class OtherSweepError(ResultExistsError):
    """A folder holds a sweep of another plan, or with shards of another size."""


class Part(NamedTuple):
    """A part of a sweep: every `parts`-th shard, from the `number`-th on.

    The processes that compute the parts share the plan and the folder, and do not communicate.
    Neighbouring shards take about the same time, so all parts get about the same work.
    """

    number: int
    parts: int

    def __str__(self) -> str:
        """Return the part as on the command line: 3/8."""
        return f"{self.number}/{self.parts}"

    def shard_numbers(self, shards: int) -> range:
        """Return the numbers of this part's shards, of so many of the sweep."""
        return range(self.number - 1, shards, self.parts)


WHOLE = Part(1, 1)
"""The part that has all shards."""


def parse_part(text: str) -> Part:
    """Parse a part such as 3/8.

    Raises:
        ValueError: The text is not a part.
    """
    match = re.fullmatch(r"([0-9]{1,9})/([0-9]{1,9})", text)
    if match is None:
        raise ValueError(f"{text!r} is not a part of a sweep (expected i/n, such as 3/8)")
    part = Part(int(match[1]), int(match[2]))
    if not 1 <= part.number <= part.parts:
        raise ValueError(f"{part} is not a part of a sweep (expected i/n with i from 1 to n)")
    return part


class OpenFolder(NamedTuple):
    """The folder of a sweep, open for writing.

    Args:
        folder: The folder.
        moved_aside: The new path of a different sweep of the same name, if there was one.
        changed: What has changed in the program since the sweep was started, as texts.
    """

    folder: SweepFolder
    moved_aside: Path | None
    changed: tuple[str, ...]


@contextmanager
def open_folder(
    path: Path, plan: Plan, shard_size: int | None, *, force: bool = False, alone: bool = False
) -> Iterator[OpenFolder]:
    """Open the folder of a plan; make it if it does not exist.

    Args:
        path: The folder.
        plan: The plan.
        shard_size: Members per shard; default the size used in the folder, or else computed.
        force: Rename the folder if it has a different sweep or other files.
        alone: Whether no other command may run in the folder, as with `force`.

    Yields:
        The folder, whose lock is held until the context ends.

    Raises:
        FolderInUseError: Another command runs, and one of the two must be alone.
        OtherSweepError: The folder has a different sweep (without `force`).
        ResultExistsError: The folder has other files (without `force`).
        StoreError: The folder cannot be written.
    """
    moved_aside = None
    wanted = _manifest(plan, shard_size)
    while True:
        with locked_folder(path, alone=alone or force):
            try:
                folder = _started(path, plan, wanted, fixed_size=shard_size is not None)
            except ResultExistsError as error:
                if not force:
                    hint = "Choose another folder with -o, or move it aside with --force"
                    raise type(error)(f"{error}; it is not overwritten. {hint}") from error
                if os.name != "nt":
                    moved_aside = _move_aside(path)
            else:
                yield OpenFolder(folder, moved_aside, _changes(folder.manifest, wanted))
                return
        if os.name == "nt":
            # Windows cannot move a folder with an open file, such as the lock.
            moved_aside = _move_aside(path)


@contextmanager
def locked_folder(path: Path, *, alone: bool = False) -> Iterator[None]:
    """Make and lock a folder, alone or together with other commands.

    Raises:
        FolderInUseError: Another command uses the folder, and one of the two must be alone.
        StoreError: The folder cannot be written.
    """
    with store_errors(path, "written"):
        path.mkdir(parents=True, exist_ok=True)
    with locked(path, shared=not alone):
        yield


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
    try:
        return _fitting(path, planned.manifest, fixed_size=shard_size is not None), True
    except OtherSweepError:
        return planned, False


def default_shard_size(
    members: int, *, has_single_runs: bool, trace_bytes: float = 0.0, shard_limit: int = 4096
) -> int:
    """Return the default number of members of a shard.

    If a process dies, little work is lost with small shards; they also give work to all threads.
    Large shards, of thousands of members, are computed faster. The size does not depend on the
    number of threads. It is a multiple of 64 where possible, because engines compute such batches
    fastest.

    Args:
        members: The number of members of the sweep.
        has_single_runs: Some members run one by one, which takes much longer.
        trace_bytes: The bytes of traces per member, on average.
        shard_limit: The most members of a shard, because of their proofs.
    """
    size = min(
        *(16 if has_single_runs else 4096, max(1024, members // 4096 * 64)),
        *(shard_limit, int(MAX_TRACE_BYTES / max(trace_bytes, 1.0))),
    )
    return size // 64 * 64 or max(1, size)


def _proof_limit(plan: Plan) -> int:
    """Return the most members of a shard, so that their proofs take some ten seconds."""
    if plan.prove is None:
        return MAX_MEMBERS
    share = plan.prove.count(plan.members) / plan.members
    together = all(shares_proof(plan, variant) for variant in plan.variants)
    return max(1, int((MAX_JOINT_PROOFS if together else MAX_PROOFS) / share))


def _manifest(plan: Plan, shard_size: int | None) -> Manifest:
    """Return the manifest that this command would write."""
    has_single_runs = plan.engine == "scipy" or any(
        problem.switching is not None or problem.schedule.names or has_modes(problem.system)
        for problem in plan.initial_value_problems.values()
    )
    traces = plan.keep.count(plan.members) * _trace_bytes(plan) / plan.members
    smallest = -(-plan.members // MAX_SHARDS)
    size = shard_size or max(
        smallest,
        default_shard_size(
            plan.members,
            has_single_runs=has_single_runs,
            trace_bytes=traces,
            shard_limit=_proof_limit(plan),
        ),
    )
    if size < smallest:
        raise StoreError(
            f"shards of {size} members would be {-(-plan.members // size)} files, and at most "
            f"{MAX_SHARDS} are supported. Choose shards of at least {smallest} members"
        )
    attributes = provenance(plan.engine)
    return Manifest(
        plan_id=plan_id(plan),
        title=plan.title,
        members=plan.members,
        shard_size=min(size, MAX_MEMBERS),
        engine=plan.engine,
        versions={
            name: attributes[name] for name in attributes if name not in ("created", "commit")
        },
        columns=tuple(columns_of(plan)),
        keep=plan.keep,
    )


def _started(path: Path, plan: Plan, wanted: Manifest, *, fixed_size: bool) -> SweepFolder:
    """Write the manifest if there is none, then the plan and the subfolders that are missing."""
    if not path_exists(path / MANIFEST):
        sweep_files = (PLAN_FILE, SHARDS, TRACES, LOCK_FILE)
        names = [file.name for file in path.iterdir()]
        foreign = [n for n in names if n not in sweep_files and not n.endswith(PARTIAL_SUFFIX)]
        # Another command may have begun the sweep since.
        if foreign and not path_exists(path / MANIFEST):
            raise ResultExistsError(f"{path} holds other files ({min(foreign)})")
        with suppress(ResultExistsError):  # another command has just written it
            write_document(path / MANIFEST, wanted.data, replace=False)
    try:
        folder = _fitting(path, wanted, fixed_size=fixed_size)
    except NotAResultError as error:
        raise ResultExistsError(f"{path} cannot be resumed ({error})") from error
    with store_errors(path, "written"):
        for name in (SHARDS, TRACES)[: 2 if wanted.keep != NO_TRACES else 1]:
            (path / name).mkdir(exist_ok=True)
        text, stored = plan_yaml(plan).encode(), b""
        with suppress(StoreError):
            stored = read_regular(path / PLAN_FILE)
        if stored != text:
            write_atomically(path / PLAN_FILE, text, replace=True)
    return folder


def _fitting(path: Path, wanted: Manifest, *, fixed_size: bool) -> SweepFolder:
    """Return the folder of a sweep that was started, if it is the wanted one."""
    folder = read_folder(path)
    manifest = folder.manifest
    if manifest.plan_id != wanted.plan_id:
        what = f"holds another sweep (plan {manifest.plan_id[:8]}, not {wanted.plan_id[:8]})"
        raise OtherSweepError(f"{path} {what}")
    if not manifest.fits(wanted):
        raise NotAResultError(f"{path / MANIFEST} is damaged: it does not fit its plan")
    if fixed_size and min(manifest.shard_size, MAX_MEMBERS) != wanted.shard_size:
        raise OtherSweepError(f"{path} was started with shards of {manifest.shard_size} members")
    return folder


def _changes(started: Manifest, now: Manifest) -> tuple[str, ...]:
    """Return what has changed in the program since a sweep was started."""
    return (
        *(
            f"{name.removesuffix('_version')} {started.versions.get(name, '?')} -> {version}"
            for name, version in now.versions.items()
            if started.versions.get(name) != version
        ),
        *(f"it has no column {name}" for name in now.columns if name not in started.columns),
    )


def _move_aside(path: Path) -> Path:
    """Rename a folder after its sweep; one that cannot be read now may be whole, and stays."""
    try:
        suffix = read_folder(path).manifest.plan_id[:8]
    except NotAResultError:
        suffix = "damaged"
    names = [path.with_name(f"{path.name}.{suffix}")]
    while path_exists(names[-1]):
        names.append(path.with_name(f"{path.name}.{suffix}-{len(names)}"))
    with store_errors(path, "moved"):
        return path.rename(names[-1])


def sweep_bytes(plan: Plan, ranges: Iterable[tuple[int, int]] = ()) -> int:
    """Return the size of a sweep on the disk in bytes, but for the headers of its files.

    Args:
        plan: The plan.
        ranges: The members to count in the shards and their traces; default all.
    """
    beside, shards = columns_beside_shards(plan).values(), columns_of(plan).values()
    member_bytes = MEMBER_BYTES * (1 + len(plan.varied_keys)) + sum(
        column.size for column in beside
    )
    total = plan.members * member_bytes
    for start, stop in ranges or [(0, plan.members)]:
        total += (stop - start) * (MEMBER_BYTES + sum(column.size for column in shards))
        if traces := _trace_bytes(plan):
            total += traces * int(plan.keep.selected(start, stop).sum())
    return total


def _trace_bytes(plan: Plan) -> int:
    """Return the size of a trace in bytes; 0 if the plan stores no traces."""
    return layout_of(plan).size + MEMBER_BYTES if plan.keep.count(plan.members) else 0


def check_disk_space(plan: Plan, folder: SweepFolder, missing: Iterable[int]) -> None:
    """Check that the disk has room for the missing shards and the members file.

    Args:
        plan: The plan.
        folder: The folder of the sweep.
        missing: The numbers of the missing shards.

    Raises:
        StoreError: The disk clearly has too little space.
    """
    ranges = folder.ranges(missing)
    free = shutil.disk_usage(folder.path).free
    if ranges and free < (needed := sweep_bytes(plan, ranges)):
        raise StoreError(
            f"{folder.path} needs {needed / 1e9:.3g} GB more, and {free / 1e9:.3g} GB are free. "
            "No member was computed; free some space, or choose another folder with -o"
        )
