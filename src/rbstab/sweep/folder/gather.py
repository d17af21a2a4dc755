"""Gathering the shards of a sweep in one file, and the summary of that file."""

import hashlib
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rbstab.experiment.provenance import provenance
from rbstab.integrate.status import RunStatus
from rbstab.mechanics.numbers import Array
from rbstab.store.disk.existence import path_exists
from rbstab.store.disk.regular_file import read_regular
from rbstab.store.errors import NotAResultError
from rbstab.store.table import VARIED, Column, Table, TableHeader
from rbstab.store.table_file import DIGEST, read_table
from rbstab.store.table_writer import write_table
from rbstab.store.variables import Variable
from rbstab.sweep.folder.layout import grid_extras, varied_arrays, varied_layout
from rbstab.sweep.folder.shard_inventory import ShardInventory
from rbstab.sweep.folder.sweep_folder import PLAN_FILE, SweepFolder
from rbstab.sweep.members.outcome import STATUSES
from rbstab.sweep.members.scipy_comparison import ScipyComparison
from rbstab.sweep.plan.dump import plan_yaml
from rbstab.sweep.plan.plan import Plan
from rbstab.sweep.proofs.columns import GATHERED_COLUMNS
from rbstab.sweep.proofs.convergence import (
    MemberConvergence,
    ProvedConvergence,
    proved_columns,
)
from rbstab.sweep.proofs.gathered import stored_convergence as stored_in

HAS_TRACE = Column((), "i1", "1", "whether the motion is kept in `traces`", ("no", "yes"))
"""The column `traces` of a sweep with traces."""


def digest_of_shards(inventory: ShardInventory) -> str:
    """Return the digest of all shards of a complete sweep."""
    digests = [facts.digest for _, facts in sorted(inventory.done.items())]
    return hashlib.sha256(" ".join(digests).encode()).hexdigest()


def is_gathered(folder: SweepFolder, shards_digest: str) -> bool:
    """Whether the file of the sweep exists, is intact, and was gathered from these shards.

    The digests of older versions do not cover the plan in the file. So it is compared with the plan
    of the folder.
    """
    if not path_exists(folder.sweep_file):
        return False
    try:
        table = read_table(folder.sweep_file, ())
    except NotAResultError:
        return False
    if table.attributes.get("shards_digest") != shards_digest:
        return False
    return DIGEST in table.attributes or _has_plan_of(folder, table)


def _has_plan_of(folder: SweepFolder, table: Table) -> bool:
    stored = table["plan"].tolist() if "plan" in table.extras else None
    return bool(stored == read_regular(folder.path / PLAN_FILE).decode())


def gather(
    plan: Plan,
    folder: SweepFolder,
    shards_digest: str,
    comparison: ScipyComparison | None,
    known: MemberConvergence | None = None,
) -> None:
    """Write the file of the sweep; only one shard is in memory at a time. The shards are kept.

    Args:
        plan: The plan.
        folder: The folder, with all shards.
        shards_digest: The digest of all shards.
        comparison: The comparison with SciPy, if there is one.
        known: What is known of the convergence of all members, beside the proofs that they share.

    Raises:
        StoreError: The file cannot be written, or a shard is missing.
    """
    manifest = folder.manifest
    attributes: dict[str, str | int | float] = {
        "title": plan.title,
        "plan_id": manifest.plan_id,
        "engine": manifest.engine,
        "design": plan.design.keyword if plan.design is not None else "grid",
        "shard_size": manifest.shard_size,
        "shards_digest": shards_digest,
        "checked_members": len(comparison.members) if comparison is not None else 0,
        "checked_unlike": comparison.unlike if comparison is not None else 0,
        **provenance(manifest.engine),
    }
    extras = grid_extras(plan)
    if comparison is not None and comparison.differences:
        extras |= _comparison_extras(comparison)
    text = np.array(plan_yaml(plan), dtype=object)
    extras["plan"] = Variable((), text, "", "resolved plan, YAML")
    varied = varied_layout(plan)
    attributes[VARIED] = " ".join(varied)
    layout = varied | folder.columns | GATHERED_COLUMNS
    if plan.keep.count(plan.members):
        layout["traces"] = HAS_TRACE
    header = TableHeader(layout, 0, manifest.members, attributes, extras)
    write_table(folder.sweep_file, header, _shards(plan, folder, known))


def stored_convergence(folder: SweepFolder) -> MemberConvergence:
    """Return what the file of a sweep says of the convergence of its members.

    Raises:
        StoreError: The file cannot be read, or is damaged.
    """
    return stored_in(read_table(folder.sweep_file, GATHERED_COLUMNS))


def _shards(
    plan: Plan, folder: SweepFolder, known: MemberConvergence | None
) -> Iterator[dict[str, Array]]:
    convergence = ProvedConvergence(plan, folder.path.parent)
    for number in range(folder.shards):
        table = folder.read(number)
        if table is None:
            raise NotAResultError(f"{folder.shard_file(number)} was lost; run the sweep again")
        bounds, arrays = folder.bounds(number), dict(table.arrays)
        proved = convergence.within(*bounds, arrays, convergence.of(*bounds))
        if known is not None:
            own = MemberConvergence(*(column[slice(*bounds)] for column in known))
            proved = own.beside(proved)
        arrays |= proved_columns(proved, arrays)
        arrays["traces"] = plan.keep.selected(*bounds).astype("i1")
        yield varied_arrays(plan, *bounds) | arrays


def _comparison_extras(comparison: ScipyComparison) -> dict[str, Variable]:
    dimensions = ("check_number",)
    names = np.array(list(comparison.differences), dtype=object)
    largest = np.array(list(comparison.differences.values()))
    long_name = "largest difference to single runs by scipy, over the largest number of the column"
    return {
        "check_column": Variable(dimensions, names, "", "columns that were compared"),
        "check_difference": Variable(dimensions, largest, "1", long_name),
    }


class SweepSummary(NamedTuple):
    """Summary of a sweep in a few numbers.

    Attributes:
        members: The number of members.
        by_status: The number of members with each status that occurs.
        settled: The number of completed members that settled.
        settling_median: The median of their settling times, s.
        worst_residual: The largest |r|/v(0) of the completed members; over v at the end if that is
            larger than v(0), as where inputs supply power. NaN if neither is above 0.
        residual_scale: By what |r| was divided, in words.
        convergence: The number of members with each word of the column `convergence` that occurs;
            empty if it is unknown of all members.
    """

    members: int
    by_status: dict[str, int]
    settled: int
    settling_median: float
    worst_residual: float
    residual_scale: str
    convergence: dict[str, int]


def sweep_summary(path: Path) -> SweepSummary:
    """Return the summary of a sweep, read from its file.

    Raises:
        StoreError: The file cannot be read, or is damaged.
    """
    names = ("status", "settling_time", "energy_residual", "lyapunov_start", "lyapunov_end")
    table = read_table(path, (*names, "convergence"))
    status, settling, residual, start, end = (table[name] for name in names)
    scale = np.fmax(start, end)
    completed = status == STATUSES.index(RunStatus.COMPLETED)
    settled = settling[completed & np.isfinite(settling)]
    moving = completed & (scale > 0)
    relative = residual[moving] / scale[moving]
    return SweepSummary(
        len(status),
        counts_by_status(np.bincount(status, minlength=len(STATUSES))),
        len(settled),
        float(np.median(settled)) if len(settled) else float("nan"),
        float(relative.max()) if len(relative) else float("nan"),
        "the larger of v(0), v(end)" if np.any(end[moving] > start[moving]) else "v(0)",
        _counts_of_convergence(table),
    )


def _counts_of_convergence(table: Table) -> dict[str, int]:
    if "convergence" not in table.layout or not table["convergence"].any():
        return {}
    flags = table.layout["convergence"].flags
    counts = np.bincount(table["convergence"], minlength=len(flags))
    return {word: n for word, n in zip(flags, counts.tolist(), strict=True) if n}


def counts_by_status(counts: Array) -> dict[str, int]:
    """Return the number of members with each status, without statuses that do not occur."""
    return {str(s): n for s, n in zip(STATUSES, counts.tolist(), strict=True) if n}
