"""The differences of members to single runs by SciPy."""

from dataclasses import dataclass

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.sweep.members.outcome import COLUMNS
from rbstab.systems.quantities import is_element_state

ENGINE = "scipy"

_NOT_COMPARED = (
    *("run_id", "status", "steps"),
    *("peak_contact_displacement_error", "peak_orientation_error"),
)

_ENERGIES = ("lyapunov_start", "lyapunov_end")

_SCALE = {
    "energy_residual": _ENERGIES,
    "energy_at_rest": _ENERGIES,
    "lyapunov_start": _ENERGIES,
    "rest_orientation": ("peak_orientation",),
}
"""For a column whose values may all be round-off: the columns whose largest absolute value divides
its differences. v is largest at the start, unless inputs supply power."""


_LEAST_SHARE = {"lyapunov_end": ("lyapunov_start", 1e-6)}
"""For a column that ends at zero: another column, and the share of its largest absolute value by
which differences are divided at least. Otherwise round-off would be compared with round-off."""


@dataclass(frozen=True)
class ScipyComparison:
    """The comparison of sampled members with single runs by SciPy.

    Args:
        shards_digest: The digest of the compared shards.
        members: The members.
        unlike: The number of members whose status, or whose NaNs, differ from the single run.
        differences: For each column, the largest difference divided by the largest absolute value.
    """

    shards_digest: str
    members: tuple[int, ...]
    unlike: int
    differences: dict[str, float]


def compare(ours: dict[str, Array], theirs: dict[str, Array]) -> tuple[int, dict[str, float]]:
    """Return the number of unlike members, and the largest differences of the other members.

    Args:
        ours: The columns of some members.
        theirs: The same columns of their single runs.

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
        a, b, *scales = (
            np.where(np.isnan(values), 0.0, values)[alike]
            for values in (
                ours[name],
                theirs[name],
                *(theirs[one] for one in _SCALE.get(name, (name,)) if one in theirs),
            )
        )
        scale = np.concatenate([values.ravel() for values in scales])
        # Infinite numbers come from diverged motions. It is enough that both motions diverge.
        finite = np.isfinite(a) & np.isfinite(b)
        largest = float(np.abs(scale[np.isfinite(scale)]).max(initial=0.0))
        if name in _LEAST_SHARE:
            other, share = _LEAST_SHARE[name]
            values = theirs[other][alike]
            largest = max(
                largest, share * float(np.abs(values[np.isfinite(values)]).max(initial=0))
            )
        difference = float(np.abs(a[finite] - b[finite]).max(initial=0.0))
        differences[name] = difference / largest if largest else difference
    return int((~alike).sum()), differences
