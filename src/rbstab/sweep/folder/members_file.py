"""The members file of a sweep: what is known of each member beside the shards; and its summary."""

from collections.abc import Iterator, Sequence

import numpy as np

from rbstab.config.numbers import unit_at
from rbstab.experiment.provenance import provenance
from rbstab.mechanics.numbers import Array
from rbstab.store.dataset_file import write_dataset
from rbstab.store.disk.paths import path_exists, read_regular
from rbstab.store.errors import NotAResultError, StoreError
from rbstab.store.table import GRID_AXIS, GRID_LENGTH, VARIED, Column, Table, columns_from
from rbstab.store.variables import RUN, Variable, safe_name
from rbstab.sweep.folder.scipy_comparison import ScipyComparison
from rbstab.sweep.folder.shard_inventory import ShardInventory
from rbstab.sweep.folder.sweep_folder import PLAN_FILE, SweepFolder
from rbstab.sweep.folder.sweep_table import MEMBERS, digest_of_all, read_members_file
from rbstab.sweep.members.engine import concatenated
from rbstab.sweep.members.outcome import STATUSES
from rbstab.sweep.plan.axes import VARIANT
from rbstab.sweep.plan.load import plan_yaml
from rbstab.sweep.plan.plan import Plan
from rbstab.sweep.proofs.columns import CONVERGENCE_COLUMNS, MOTION_COLUMNS
from rbstab.sweep.proofs.convergence import MemberConvergence, ProvedConvergence, proved_columns

HAS_TRACE = Column((), "i1", "1", "whether the motion is kept in `traces`", ("no", "yes"))
"""The column `traces` of a sweep with traces."""

RELATIVE_RESIDUAL = ("energy_residual", "energy_scale")
"""The columns that `relative_residuals` needs."""


def varied_columns(plan: Plan, start: int, stop: int) -> dict[str, Variable]:
    """Return the values of the varied keys of some members, by their netCDF names.

    Args:
        plan: The plan.
        start: The number of the first member.
        stop: The number after the last member.
    """
    variables = {}
    for varied, values in zip(plan.varied_keys, plan.values(start, stop).values(), strict=True):
        column, data = Column((), "f8", "1", f"factor on {varied.key}"), values.tolist()
        if varied.path == VARIANT:
            column = Column((), "i1", "1", varied.key, plan.variants)
            data = list(map(plan.variants.index, data))
        elif not varied.scale:
            units = {unit_at(base, varied.key) for base in plan.bases.values()} - {""}
            column = Column((), "f8", units.pop() if len(units) == 1 else "", varied.key)
        variables[safe_name(varied.key)] = column.of(data)
    return variables


def columns_beside_shards(plan: Plan) -> dict[str, Column]:
    """Return the columns of the members file, but for the varied keys."""
    traces = {"traces": HAS_TRACE} if plan.keep.count(plan.members) else {}
    proved = {} if plan.prove is None else {"proved_time": MOTION_COLUMNS["proved_time"]}
    return CONVERGENCE_COLUMNS | proved | traces


def plan_variables(plan: Plan) -> dict[str, Variable]:
    """Return the plan as text, the axes along which members are counted, and their lengths."""
    dimensions = ("grid_axis_number",)
    names, lengths = list(plan.dimensions.keys()), list(plan.dimensions.values())
    long_name = "axes along which members are counted, the last one fastest"
    text = np.array(plan_yaml(plan), dtype=object)
    return {
        GRID_AXIS: Variable(dimensions, np.array(names, dtype=object), "", long_name),
        GRID_LENGTH: Variable(dimensions, np.array(lengths), "1", "their lengths"),
        "plan": Variable((), text, "", "resolved plan, YAML"),
    }


def digest_of_shards(inventory: ShardInventory) -> str:
    """Return the digest of all shards of a complete sweep."""
    return digest_of_all(facts.digest for _, facts in sorted(inventory.done.items()))


def members_of_shards(folder: SweepFolder, shards_digest: str) -> Table | None:
    """Return what the members file says of proofs; None if it is damaged, or of other shards."""
    if not path_exists(folder.sweep_file):
        return None
    try:
        table = read_members_file(folder, CONVERGENCE_COLUMNS)
    except NotAResultError:
        return None
    return table if table.attributes.get("shards_digest") == shards_digest else None


def is_finished(folder: SweepFolder, table: Table | None) -> bool:
    """Whether the members file of the shards is of the folder's plan, too.

    What is wanted of the bodies may have changed in the plan, which is then of the same identity.

    Args:
        folder: The folder.
        table: The members file, from `members_of_shards`.
    """
    if table is None or "plan" not in table:
        return False
    return str(table["plan"]).encode(errors="replace") == read_regular(folder.path / PLAN_FILE)


def write_members_file(
    plan: Plan,
    folder: SweepFolder,
    shards_digest: str,
    comparison: ScipyComparison | None,
    convergence: MemberConvergence | None = None,
) -> None:
    """Write the members file: the varied values, what is proved of each member, and the plan.

    Args:
        plan: The plan.
        folder: The folder, with all shards.
        shards_digest: The digest of all shards.
        comparison: The comparison with SciPy, if there is one.
        convergence: What is known of that of all members, beside the proofs that they share.

    Raises:
        StoreError: The file cannot be written, or a shard is missing.
    """
    manifest, varied = folder.manifest, varied_columns(plan, 0, plan.members)
    compared = comparison or ScipyComparison((), 0, {})
    attributes: dict[str, str | int | float] = {
        "title": plan.title,
        "plan_id": manifest.plan_id,
        "engine": manifest.engine,
        "design": plan.design.keyword if plan.design is not None else "grid",
        "shard_size": manifest.shard_size,
        "shards_digest": shards_digest,
        "checked_members": len(compared.members),
        "checked_unlike": compared.unlike,
        **provenance(manifest.engine),
        VARIED: " ".join(varied),
    }
    arrays = concatenated(list(_shards(plan, folder, convergence)))
    columns = columns_from(columns_beside_shards(plan), arrays)
    variables = {RUN: columns[RUN], **varied, **columns, **plan_variables(plan)}
    if comparison is not None:
        variables |= comparison.variables
    write_dataset(folder.sweep_file, Table(variables, attributes, kind=MEMBERS), replace=True)


def _shards(
    plan: Plan, folder: SweepFolder, convergence: MemberConvergence | None
) -> Iterator[dict[str, Array]]:
    proofs = ProvedConvergence(plan, folder.path.parent)
    for number in range(folder.shards):
        try:
            shard = folder.read(number)
        except NotAResultError as error:
            raise StoreError(f"{error}; run the sweep again") from error
        bounds = folder.bounds(number)
        proved = proofs.within(*bounds, shard, proofs.of(*bounds))
        if convergence is not None:
            of_shard = MemberConvergence(*(column[slice(*bounds)] for column in convergence))
            proved = of_shard.beside(proved)
        yield {
            RUN: shard[RUN],
            "traces": plan.keep.selected(*bounds).astype("i1"),
            **proved_columns(proved, shard),
        }


def relative_residuals(table: Table) -> Array:
    """Return the largest |r| of each member over its largest energy."""
    with np.errstate(all="ignore"):
        return np.asarray(table["energy_residual"] / table["energy_scale"])


def counts_by_status(counts: Array) -> dict[str, int]:
    """Return the number of members with each status, without statuses that do not occur."""
    return counts_by(STATUSES, counts)


def counts_by(words: Sequence[str], counts: Array) -> dict[str, int]:
    """Return the counts that are not 0, by word."""
    return {str(word): n for word, n in zip(words, counts.tolist(), strict=False) if n}
