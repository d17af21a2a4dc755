"""Compare a few stored members with single runs by SciPy. The plan alone decides which."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rbstab.config.source import key_of
from rbstab.mechanics.attitude import rotations
from rbstab.mechanics.numbers import Array
from rbstab.store.table import Table
from rbstab.store.variables import Variable
from rbstab.sweep.folder.sweep_folder import SweepFolder
from rbstab.sweep.members.engine import concatenated
from rbstab.sweep.members.outcome import COLUMNS, FINAL_PREFIX, LARGEST_PREFIX
from rbstab.sweep.members.single import SingleRuns
from rbstab.sweep.plan.axes import VARIANT
from rbstab.sweep.plan.plan import Plan
from rbstab.sweep.plan.proof_selection import ProofSelection
from rbstab.systems.quantities import is_element_state

ENGINE = "scipy"

COMPARED = 4
"""The number of compared members, unless a number is given."""

CANDIDATES = 256
"""Members among which those of each variant are looked for, for each one that is compared."""

_NOT_COMPARED = (
    *("status", "steps"),
    *(name for name in COLUMNS if name.endswith("_error")),
    # It is the cosine of a peak that is compared, and may be round-off.
    "smallest_regularity",
)

_SCALE = {
    "energy_residual": "energy_scale",
    "energy_at_rest": "energy_scale",
    "lyapunov_start": "energy_scale",
    "lyapunov_end": "energy_scale",
    "rest_orientation": "peak_orientation",
    "peak_tilt": "peak_orientation",
}
"""For a column whose values may all be round-off: the column whose largest absolute value divides
its differences. The final values of a quantity are divided by its largest samples."""

LEAST_SCALE = 1e-8
"""Differences of vectors are divided by at least this, in SI units. A body at rest has nothing but
round-off, which would be compared with round-off."""


@dataclass(frozen=True)
class ScipyComparison:
    """The comparison of some members with single runs by SciPy.

    Args:
        members: The members.
        unlike: The number of members whose status, or whose NaNs, differ from the single run.
        differences: For each column, the largest difference divided by the largest energy, by the
            largest sample of the quantity, or by the largest absolute value of the column.
    """

    members: tuple[int, ...]
    unlike: int
    differences: dict[str, float]

    @property
    def variables(self) -> dict[str, Variable]:
        """The comparison as variables of the members file."""
        names = np.array(list(self.differences), dtype=object)
        largest = np.array(list(self.differences.values()), dtype=float)
        divided = (
            "largest difference to single runs by scipy, over the largest number of the column"
        )
        entries = {
            "check_member": (
                "check_run",
                np.array(self.members, int),
                "members that were compared",
            ),
            "check_column": ("check_number", names, "columns that were compared"),
            "check_difference": ("check_number", largest, divided),
        }
        return {
            name: Variable((dimension,), data, "" if data.dtype == object else "1", long_name)
            for name, (dimension, data, long_name) in entries.items()
            if name == "check_member" or self.differences
        }


def comparison_of(folder: SweepFolder, table: Table | None) -> ScipyComparison | None:
    """Return the comparison in the members file of a sweep; None if there is none."""
    if table is None or "check_member" not in table:
        return None
    members, unlike = table["check_member"], table.attributes.get("checked_unlike")
    names = table["check_column"].tolist() if "check_column" in table else []
    is_valid = set(names) <= set(folder.manifest.columns) and members.dtype.kind == "i"
    if not is_valid or not isinstance(unlike, int):
        return None
    largest = table["check_difference"].tolist() if names else []
    return ScipyComparison(tuple(members.tolist()), unlike, dict(zip(names, largest, strict=False)))


def compare_with_scipy(
    plan: Plan,
    folder: SweepFolder,
    count: int | None,
    kept: ScipyComparison | None,
    progress: Callable[[int, int], bool],
) -> ScipyComparison | None:
    """Return the comparison of a sweep with SciPy: the one that is kept, or a new one.

    Args:
        plan: The plan.
        folder: The folder, with all shards.
        count: The number of members to compare; default: those of the kept comparison, or else
            see `members_to_compare`.
        kept: A comparison of these shards.
        progress: Called before each member, and at the end, with the numbers of members that were
            compared and of all; returns whether to go on.

    Returns:
        The comparison; None if it was stopped.

    Raises:
        StoreError: A shard is missing or damaged.
    """
    if kept is not None and count is None:
        return kept
    members = members_to_compare(plan, count)
    if kept is not None and list(kept.members) == members:
        return kept
    singles = SingleRuns(plan, ENGINE, with_largest=True)
    stored, rerun = [], []
    for done, member in enumerate(members):
        if not progress(done, len(members)):
            return None
        rerun.append(singles.compute(member, member + 1).outcome)
        shard, row = divmod(member, folder.manifest.shard_size)
        table = folder.read(shard)
        stored.append({name: table[name][[row]] for name in table.columns})
    if not members:
        return ScipyComparison((), 0, {})
    progress(len(members), len(members))
    pair = [concatenated(columns) for columns in (stored, rerun)]
    if plan.in_quaternions:
        pair = [_with_rotations(columns) for columns in pair]
    return ScipyComparison(tuple(members), *compare(*pair))


def _with_rotations(columns: dict[str, Array]) -> dict[str, Array]:
    """Return columns with rotations in place of Θ, whose θ1 and θ3 are not sharp near θ2 = ±90°."""
    changed = {
        name: rotations(columns[name]).reshape(-1, 9)
        for name in ("final_orientation", "rest_orientation")
    }
    return columns | changed | {"peak_orientation": np.ones_like(columns["peak_orientation"])}


def is_comparable(variant: str) -> bool:
    """Return whether two engines find the same trajectories: not if the motion may be chaotic."""
    return variant != "sliding"


def members_to_compare(plan: Plan, count: int | None = None) -> list[int]:
    """Return the members to compare, ascending: spread over the plan, of each variant as many.

    Args:
        plan: The plan.
        count: How many; default `COMPARED`. At least one of each comparable variant is compared.
    """
    variants = list(filter(is_comparable, plan.variants))
    count = max(count or COMPARED, len(variants))
    left = {
        variant: count // len(variants) + (number < count % len(variants))
        for number, variant in enumerate(variants)
    }
    members = []
    for member in ProofSelection().first(CANDIDATES * count, plan.members):
        values = plan.values(member, member + 1, [key_of(VARIANT)])
        variant = plan.variant_of({key: entries[0] for key, entries in values.items()})
        if left.get(variant):
            left[variant] -= 1
            members.append(member)
        if not any(left.values()):
            break
    return sorted(members)


def compare(stored: dict[str, Array], rerun: dict[str, Array]) -> tuple[int, dict[str, float]]:
    """Return the number of unlike members, and the largest differences of the other members.

    Args:
        stored: The columns of some members.
        rerun: The same columns of their single runs, and the largest samples of `FINAL`.

    Returns:
        `unlike` and `differences` of a `ScipyComparison`.
    """
    compared = (*COLUMNS, *filter(is_element_state, stored))
    columns = [name for name in compared if name in stored and name not in _NOT_COMPARED]
    alike = stored["status"] == rerun["status"]
    for name in columns:
        same = np.isnan(stored[name]) == np.isnan(rerun[name])
        alike &= same.reshape(len(same), -1).all(axis=1)
    differences = {}
    for name in columns:
        a, b, scale = (
            np.where(np.isnan(values), 0.0, values)[alike]
            for values in (stored[name], rerun[name], rerun[_scale_of(name)])
        )
        # Infinite numbers come from diverged motions. It is enough that both motions diverge.
        finite = np.isfinite(a) & np.isfinite(b)
        least = LEAST_SCALE if scale.ndim > 1 else 0.0
        largest = float(np.abs(scale[np.isfinite(scale)]).max(initial=least))
        difference = float(np.abs(a[finite] - b[finite]).max(initial=0.0))
        differences[name] = difference / largest if largest else difference
    return int((~alike).sum()), differences


def _scale_of(name: str) -> str:
    """Return the column by whose largest absolute value the differences of a column are divided."""
    if name.startswith(FINAL_PREFIX):
        return LARGEST_PREFIX + name.removeprefix(FINAL_PREFIX)
    return _SCALE.get(name, name)
