"""The members file of a sweep: what is known of each member beside the shards; and its summary."""

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
from rbstab.store.table import VARIED, Column, Table
from rbstab.store.table_file import write_table
from rbstab.store.variables import RUN, Variable
from rbstab.sweep.folder.layout import grid_extras, varied_arrays, varied_layout
from rbstab.sweep.folder.shard_inventory import ShardInventory
from rbstab.sweep.folder.sweep_folder import PLAN_FILE, SweepFolder
from rbstab.sweep.folder.sweep_table import MEMBERS, read_members_file, read_sweep
from rbstab.sweep.members.outcome import STATUSES
from rbstab.sweep.members.scipy_comparison import ScipyComparison
from rbstab.sweep.plan.dump import plan_yaml
from rbstab.sweep.plan.plan import Plan
from rbstab.sweep.proofs.columns import KNOWN_COLUMNS
from rbstab.sweep.proofs.convergence import (
    MemberConvergence,
    ProvedConvergence,
    proved_columns,
)
from rbstab.sweep.proofs.known import stored_convergence as stored_in

HAS_TRACE = Column((), "i1", "1", "whether the motion is kept in `traces`", ("no", "yes"))
"""The column `traces` of a sweep with traces."""


def digest_of_shards(inventory: ShardInventory) -> str:
    """Return the digest of all shards of a complete sweep."""
    digests = [facts.digest for _, facts in sorted(inventory.done.items())]
    return hashlib.sha256(" ".join(digests).encode()).hexdigest()


def is_finished(folder: SweepFolder, shards_digest: str) -> bool:
    """Whether the members file exists, is intact, and is of these shards and the folder's plan.

    What is wanted of the bodies may have changed in the plan, which is then of the same identity.
    """
    table = _of_shards(folder, shards_digest)
    return table is not None and _has_plan_of(folder, table)


def known_convergence(folder: SweepFolder, shards_digest: str) -> MemberConvergence | None:
    """Return what the members file says of convergence; None if it is not of these shards."""
    return None if _of_shards(folder, shards_digest) is None else stored_convergence(folder)


def _of_shards(folder: SweepFolder, shards_digest: str) -> Table | None:
    """Return what is known of the members; None if it is not of these shards."""
    if not path_exists(folder.sweep_file):
        return None
    try:
        table = read_members_file(folder, KNOWN_COLUMNS)
    except NotAResultError:
        return None
    return table if table.attributes.get("shards_digest") == shards_digest else None


def _has_plan_of(folder: SweepFolder, table: Table) -> bool:
    stored = str(table["plan"]) if "plan" in table.extras else ""
    return stored.encode(errors="replace") == read_regular(folder.path / PLAN_FILE)


def write_members_file(
    plan: Plan,
    folder: SweepFolder,
    shards_digest: str,
    comparison: ScipyComparison | None,
    known: MemberConvergence | None = None,
) -> None:
    """Write the members file: the varied values, what is proved of each member, and the plan.

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
    layout = varied | KNOWN_COLUMNS
    if plan.keep.count(plan.members):
        layout["traces"] = HAS_TRACE
    shards = list(_shards(plan, folder, known))
    arrays = {name: np.concatenate([shard[name] for shard in shards]) for name in (RUN, *layout)}
    write_table(folder.sweep_file, MEMBERS, layout, arrays, attributes, extras)


def stored_convergence(folder: SweepFolder) -> MemberConvergence:
    """Return what the members file says of convergence.

    Raises:
        StoreError: The file cannot be read, or is damaged.
    """
    return stored_in(read_members_file(folder, KNOWN_COLUMNS))


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
        yield {
            RUN: table[RUN],
            "traces": plan.keep.selected(*bounds).astype("i1"),
            **varied_arrays(plan, *bounds),
            **proved_columns(proved, arrays),
        }


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
        worst_residual: The largest |r| of the completed members over their largest energy; NaN if
            none completed.
        convergence: The number of members with each word of the column `convergence` that occurs;
            empty if it is unknown of all members.
    """

    members: int
    by_status: dict[str, int]
    settled: int
    settling_median: float
    worst_residual: float
    convergence: dict[str, int]


def sweep_summary(path: Path) -> SweepSummary:
    """Return the summary of a finished sweep.

    Raises:
        StoreError: The file cannot be read, or is damaged.
    """
    table = read_sweep(path, ("status", "settling_time", *RELATIVE_RESIDUAL, "convergence"))
    status, settling = table["status"], table["settling_time"]
    completed = status == STATUSES.index(RunStatus.COMPLETED)
    settled = settling[completed & np.isfinite(settling)]
    relative = relative_residuals(table)[completed]
    return SweepSummary(
        len(status),
        counts_by_status(np.bincount(status, minlength=len(STATUSES))),
        len(settled),
        float(np.median(settled)) if len(settled) else float("nan"),
        float(relative.max()) if len(relative) else float("nan"),
        _counts_of_convergence(table),
    )


RELATIVE_RESIDUAL = ("energy_residual", "energy_scale")
"""The columns that `relative_residuals` needs."""


def relative_residuals(table: Table) -> Array:
    """Return the largest |r| of each member over its largest energy."""
    with np.errstate(all="ignore"):
        return np.asarray(table["energy_residual"] / table["energy_scale"])


def _counts_of_convergence(table: Table) -> dict[str, int]:
    if not table["convergence"].any():
        return {}
    flags = table.layout["convergence"].flags
    counts = np.bincount(table["convergence"], minlength=len(flags))
    return {word: n for word, n in zip(flags, counts.tolist(), strict=True) if n}


def counts_by_status(counts: Array) -> dict[str, int]:
    """Return the number of members with each status, without statuses that do not occur."""
    return {str(s): n for s, n in zip(STATUSES, counts.tolist(), strict=True) if n}
