"""The members whose body and gains lie inside the box of a stored proof for all such bodies."""

from collections.abc import Mapping
from functools import cached_property
from pathlib import Path as FilePath

import numpy as np

from rbstab.analysis.bounded import bounded_decimal, bounded_decimals
from rbstab.config.build import system_of
from rbstab.config.numbers import replaced
from rbstab.config.schema import Config
from rbstab.config.source import Path
from rbstab.elements.gravity import Gravity
from rbstab.elements.inputs.loads import ConstantForce
from rbstab.elements.translational_stabilizer import TranslationalStabilizer
from rbstab.experiment.robust.covering import (
    counterexample_between,
    known_of,
    valid_proofs,
)
from rbstab.experiment.robust.record import BodiesRecord
from rbstab.experiment.stored_proof.starts import OPEN_RANGE
from rbstab.mechanics.numbers import Array
from rbstab.sweep.plan.plan import Plan
from rbstab.sweep.plan.varied_numbers import varied_numbers
from rbstab.sweep.proofs.columns import NO_PROOF, PROVED

ROUND_OFF = 1e-9
"""Relative error allowed for v(0), which is in doubles."""

START_COLUMNS = ("lyapunov_start", "energy_at_rest", "rest_orientation")
"""The columns of a shard that are needed."""


class RobustProofs:
    """The members of a variant that converge by a proof for all bodies within tolerances.

    Args:
        plan: The plan.
        variant: The variant; its members differ in more than their initial state.
        results: The folder of results, which contains the stored proofs.
    """

    def __init__(self, plan: Plan, variant: str, results: FilePath) -> None:
        self.plan, self.variant, self.results = plan, variant, results

    def of(self, values: Mapping[str, Array], count: int) -> tuple[Array, Array]:
        """Return what the proofs say of each member, whatever its start.

        Args:
            values: The values of the members from `Plan.values`, each of shape (count,).
            count: The number of members.

        Returns:
            The level of v, J, below which it converges, 0 where no proof covers it; and whether its
            body has one rest state, by its code in `ONE_STATE_WORDS`; both of shape (count,).
        """
        return known_of(self._records, *self._numbers(values), count)

    @property
    def has_counterexamples(self) -> bool:
        """Whether a stored proof names a body with several rest states, or one that is no minimum.

        It may lie outside of the bounds of the plan.
        """
        return any(record.proved is False for record in self._records)

    def counterexample(self, values: Mapping[str, Array]) -> BodiesRecord | None:
        """Return a body between the bounds of the plan that has not one rest state, or None.

        Args:
            values: The values of all members of the variant.
        """
        return counterexample_between(self._records, *self._numbers(values))

    def codes(
        self, values: Mapping[str, Array], outcome: Mapping[str, Array], levels: Array
    ) -> Array:
        """Return what is proved of each member: its code in `CONVERGENCE`, shape (members,).

        It is `PROVED` or `NO_PROOF`: outside of the region of all bodies in the box, the proof of
        its own body may say more.

        A member in the box of a proof has one rest state in the range of eq. 5. So v counts from it
        if the rest state that the member approaches lies in this range.

        Args:
            values: The values of the members from `Plan.values`, each of shape (members,).
            outcome: The columns of the members in their shard.
            levels: The levels of the members, from `of`, each of shape (members,).
        """
        count = len(outcome["lyapunov_start"])
        nothing = np.full(count, NO_PROOF, dtype=np.int8)
        if not np.any(levels > 0):  # so without a controller, where nothing is ever proved
            return nothing
        start, rest = outcome["lyapunov_start"], outcome["energy_at_rest"]
        load = _load_energies(*self._numbers(values), count)
        error = ROUND_OFF * (np.abs(start) + np.abs(rest) + load)
        in_range = np.all(np.abs(outcome["rest_orientation"]) <= OPEN_RANGE, axis=-1)
        inside = in_range & (start + error < levels)
        return np.where(inside, PROVED, nothing)

    def _numbers(self, values: Mapping[str, Array]) -> tuple[Config, dict[Path, Array]]:
        """Return the base of the members, and the values of its varied numbers by path."""
        base, keys = self.plan.base_of(self.variant), self.plan.varied_keys_of(self.variant)
        floats = {varied.key: values[varied.key].astype(float) for varied in keys}
        return base, varied_numbers(base, keys, floats)

    @cached_property
    def _records(self) -> list[BodiesRecord]:
        return valid_proofs(self.results, self.plan.base_of(self.variant))


def _load_energies(base: Config, varied: Mapping[Path, Array], count: int) -> Array:
    """Return b² = 2 G'K_t⁻¹G of each member, J: a measure of the energies that E = v + U* sums.

    The energy of the stabilizer is ½ X'K_t X <= P, the sum of all energies that are not negative.
    So |G'X| <= b √P, and E = P - G'X. Then P <= 2|E| + b², and P + |G'X| <= 3|E| + 2b². So the
    round-off of v, at most `SUM_ERROR` times that, is far below `ROUND_OFF` (|E| + b²).

    Args:
        base: The base of the members.
        varied: The values of their varied numbers by path, each of shape (count,).
        count: The number of members.
    """
    numbers = {path: bounded_decimal(value) for path, value in varied.items()}
    with np.errstate(all="ignore"):  # what is not finite proves nothing
        system = system_of(replaced(base, numbers), bounded_decimals)
        (weight,) = (e.weight for e in system.elements if isinstance(e, Gravity))
        stabilizers = [e for e in system.elements if isinstance(e, TranslationalStabilizer)]
        loaded = any(isinstance(e, ConstantForce) for e in system.elements)
        if loaded or not stabilizers:  # no such measure is known: nothing is proved
            return np.full(count, np.inf)
        K_t = stabilizers[0].K_t
        G = _values(weight, count)
        stiffness = _values(K_t.ravel(), count).reshape(count, 3, 3)
        try:
            reached = np.linalg.solve(stiffness, G[..., np.newaxis])[..., 0]
        except np.linalg.LinAlgError:  # a stiffness is singular: nothing is proved
            return np.full(count, np.inf)
        load: Array = 2.0 * (G * reached).sum(axis=1)
        return load


def _values(entries: Array, count: int) -> Array:
    """Return the values of bounded numbers, shape (count, entries)."""
    columns = [getattr(entry, "value", entry) for entry in entries.tolist()]
    return np.stack([np.broadcast_to(np.asarray(x, float), (count,)) for x in columns], axis=1)
