"""The differences of a few members to single runs by SciPy. The plan alone decides which."""

from dataclasses import dataclass

import numpy as np

from rbstab.config.source import key_of
from rbstab.mechanics.numbers import Array
from rbstab.sweep.members.outcome import COLUMNS, FINAL_PREFIX, LARGEST_PREFIX
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
    *("peak_contact_displacement_error", "peak_orientation_error"),
)

_SCALE = {
    "energy_residual": "energy_scale",
    "energy_at_rest": "energy_scale",
    "lyapunov_start": "energy_scale",
    "lyapunov_end": "energy_scale",
    "rest_orientation": "peak_orientation",
}
"""For a column whose values may all be round-off: the column whose largest absolute value divides
its differences. The final values of a quantity are divided by its largest samples."""

LEAST_SCALE = 1e-8
"""Differences of vectors are divided by at least this, in SI units. A body at rest has nothing but
round-off, which would be compared with round-off."""


@dataclass(frozen=True)
class ScipyComparison:
    """The comparison of sampled members with single runs by SciPy.

    Args:
        shards_digest: The digest of the compared shards.
        members: The members.
        unlike: The number of members whose status, or whose NaNs, differ from the single run.
        differences: For each column, the largest difference divided by the largest energy, by the
            largest sample of the quantity, or by the largest absolute value of the column.
    """

    shards_digest: str
    members: tuple[int, ...]
    unlike: int
    differences: dict[str, float]


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


def compare(ours: dict[str, Array], theirs: dict[str, Array]) -> tuple[int, dict[str, float]]:
    """Return the number of unlike members, and the largest differences of the other members.

    Args:
        ours: The columns of some members.
        theirs: The same columns of their single runs, and the largest samples of `FINAL`.

    Returns:
        `unlike` and `differences` of a `ScipyComparison`.
    """
    compared = (*COLUMNS, *filter(is_element_state, ours))
    columns = [name for name in compared if name in ours and name not in _NOT_COMPARED]
    alike = ours["status"] == theirs["status"]
    for name in columns:
        same = np.isnan(ours[name]) == np.isnan(theirs[name])
        alike &= same.reshape(len(same), -1).all(axis=1)
    differences = {}
    for name in columns:
        a, b, scale = (
            np.where(np.isnan(values), 0.0, values)[alike]
            for values in (ours[name], theirs[name], theirs[_scale_of(name)])
        )
        # Infinite numbers come from diverged motions. It is enough that both motions diverge.
        finite = np.isfinite(a) & np.isfinite(b)
        least = LEAST_SCALE if a.ndim > 1 else 0.0
        largest = float(np.abs(scale[np.isfinite(scale)]).max(initial=least))
        difference = float(np.abs(a[finite] - b[finite]).max(initial=0.0))
        differences[name] = difference / largest if largest else difference
    return int((~alike).sum()), differences


def _scale_of(name: str) -> str:
    """Return the column by whose largest absolute value the differences of a column are divided."""
    if name.startswith(FINAL_PREFIX):
        return LARGEST_PREFIX + name.removeprefix(FINAL_PREFIX)
    return _SCALE.get(name, name)
