"""The members whose body and gains lie inside the box of a stored proof for all such bodies."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from rbstab.elements.gravity import Gravity
from rbstab.elements.translational_stabilizer import TranslationalStabilizer
from rbstab.experiment.proof import OPEN_RANGE, ROUND_OFF
from rbstab.experiment.robust.covering import robust_levels
from rbstab.mechanics.numbers import Array
from rbstab.sweep.plan.plan import Plan
from rbstab.sweep.plan.varied_numbers import varied_numbers
from rbstab.systems.system import System

START_COLUMNS = ("lyapunov_start", "energy_at_rest", "rest_orientation")
"""The columns of a shard that are needed."""


class RobustProofs:
    """The members of a variant that converge by a proof for all bodies within tolerances.

    Args:
        plan: The plan.
        variant: The variant; its members differ in more than their initial state.
        results: The folder of results, which contains the stored proofs.
    """

    def __init__(self, plan: Plan, variant: str, results: Path) -> None:
        self.plan, self.variant, self.results = plan, variant, results
        self._load_energy = _load_energy(plan.initial_value_problems[variant].system)

    def proved(self, values: Mapping[str, Array], outcome: Mapping[str, Array]) -> Array:
        """Return whether each member converges to its only rest state, shape (members,).

        Such a member has one rest state in the range of eq. 5. So v counts from it if the rest
        state that the member approaches lies in this range.

        Args:
            values: The values of the members from `Plan.values`, each of shape (members,).
            outcome: The columns of the members in their shard.
        """
        count = len(outcome["lyapunov_start"])
        if "rest_orientation" not in outcome:  # an older sweep: v may count from elsewhere
            return np.zeros(count, dtype=bool)
        base, keys = self.plan.base_of(self.variant), self.plan.varied_keys_of(self.variant)
        floats = {varied.key: values[varied.key].astype(float) for varied in keys}
        varied = varied_numbers(base, keys, floats)
        levels = robust_levels(self.results, base, varied, count)
        start, rest = outcome["lyapunov_start"], outcome["energy_at_rest"]
        error = ROUND_OFF * (np.abs(start) + np.abs(rest) + self._load_energy)
        in_range = np.all(np.abs(outcome["rest_orientation"]) <= OPEN_RANGE, axis=-1)
        inside: Array = in_range & (start + error < levels)
        return inside


def _load_energy(system: System) -> float:
    """Return b² = 2 G'K_t⁻¹G, J, for the size of the energies that are added up in E = v + U*.

    The energy of the stabilizer is ½ X'K_t X <= P, the sum of all energies that are not negative.
    So |G'X| <= b √P, and E = P - G'X. Then P <= 2|E| + b², and P + |G'X| <= 3|E| + 2b². The
    round-off of v is at most 1e-13 times that (`SUM_ERROR`). So `ROUND_OFF` (|E| + b²) is enough
    also for members whose own b² is a thousand times that of the base.
    """
    (weight,) = (one.weight for one in system.elements if isinstance(one, Gravity))
    (stiffness,) = (one.K_t for one in system.elements if isinstance(one, TranslationalStabilizer))
    return float(2.0 * weight @ np.linalg.solve(stiffness, weight)) if weight.any() else 0.0
