"""The members whose body and gains lie inside the box of a stored proof for all such bodies."""

from collections.abc import Iterator, Mapping, Sequence
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
from rbstab.elements.motors import LimitedForce
from rbstab.elements.translational_stabilizer import TranslationalStabilizer
from rbstab.experiment.robust.covering import (
    counterexample_between,
    member_claims,
    valid_proofs,
)
from rbstab.experiment.robust.record import BodiesRecord
from rbstab.experiment.stored_proof.starts import OPEN_RANGE
from rbstab.mechanics.numbers import Array
from rbstab.store.table import Table
from rbstab.sweep.plan.axes import varied_numbers
from rbstab.sweep.plan.plan import Plan
from rbstab.sweep.proofs.variants import rows_of_variants

ROUND_OFF = 1e-9
"""Relative error allowed for v(0), which is in doubles."""

START_COLUMNS = ("lyapunov_start", "energy_at_rest", "rest_orientation")
"""The columns of a shard that are needed."""


class BoxProofs:
    """What stored proofs for all bodies within tolerances say of the members of a plan.

    Args:
        plan: The plan.
        variants: Variants whose members differ in more than their initial state.
        results: The folder of results, which contains the stored proofs.
    """

    def __init__(self, plan: Plan, variants: Sequence[str], results: FilePath) -> None:
        self.plan, self.variants, self.results = plan, variants, results
        self._last: tuple[tuple[int, int], tuple[Array, Array]] | None = None

    def of(self, start: int, stop: int) -> tuple[Array, Array]:
        """Return what they say of the members from number `start` up to `stop`, whatever its start.

        Returns:
            The level, J: such a member has one rest state, a minimum, and its motions with v(0)
            below the level converge to it; 0 where no such proof says anything. And whether its
            body has one rest state, by its code in `SOLE_STATE_WORDS`. Both of shape (members,).
        """
        if self._last is None or self._last[0] != (start, stop):
            levels, codes = np.zeros(stop - start), np.zeros(stop - start, np.int8)
            for variant, rows, numbers in self._members(start, stop):
                levels[rows], codes[rows] = member_claims(
                    self._records[variant], *numbers, len(rows)
                )
            self._last = (start, stop), (levels, codes)
        return self._last[1]

    def proved(self, start: int, stop: int, table: Table) -> Array:
        """Return which members converge, as they start in the region of all bodies of a box.

        A member in the box of a proof has one rest state in the range of eq. 5. So v counts from it
        if the rest state that the member approaches lies in this range.

        Args:
            start: The first member.
            stop: One after the last member, as in `range`.
            table: Their table, with `START_COLUMNS`.
        """
        (levels, _), in_region = self.of(start, stop), np.zeros(stop - start, dtype=bool)
        if not levels.any():
            return in_region
        for _, rows, numbers in self._members(start, stop):
            if not levels[rows].any():  # so without a controller, where nothing is ever proved
                continue
            v, rest, Theta = (table[name][rows] for name in START_COLUMNS)
            error = ROUND_OFF * (np.abs(v) + np.abs(rest) + _load_energies(*numbers, len(rows)))
            in_range = np.all(np.abs(Theta) <= OPEN_RANGE, axis=-1)
            in_region[rows] = in_range & (v + error < levels[rows])
        return in_region

    def counterexamples(self) -> dict[str, BodiesRecord]:
        """Return by variant a body between the bounds of the plan that has not one rest state."""
        by_variant: dict[str, BodiesRecord] = {}
        if all(record.proved for records in self._records.values() for record in records):
            return by_variant  # the values of a million members take a while
        for variant, _, numbers in self._members(0, self.plan.members):
            record = counterexample_between(self._records[variant], *numbers)
            if record is not None:
                by_variant[variant] = record
        return by_variant

    def _members(
        self, start: int, stop: int
    ) -> Iterator[tuple[str, Array, tuple[Config, dict[Path, Array]]]]:
        """Yield each variant, its rows, its base and the values of its varied numbers by path."""
        for variant, rows, values in rows_of_variants(self.plan, self.variants, start, stop):
            base, keys = self.plan.base_of(variant), self.plan.varied_keys_of(variant)
            floats = {varied.key: values[varied.key].astype(float) for varied in keys}
            yield variant, rows, (base, varied_numbers(base, keys, floats))

    @cached_property
    def _records(self) -> dict[str, list[BodiesRecord]]:
        """The proofs and the counterexamples of each variant."""
        return {v: valid_proofs(self.results, self.plan.base_of(v)) for v in self.variants}


def _load_energies(base: Config, varied: Mapping[Path, Array], count: int) -> Array:
    """Return b² = 2 G'K_t⁻¹G of each member, J: a measure of the energies that E = v + U* sums."""
    # The energy of the stabilizer is ½ X'K_t X <= P, the sum of all energies that are not negative.
    # So |G'X| <= b √P, and E = P - G'X. Then P <= 2|E| + b², and P + |G'X| <= 3|E| + 2b². So the
    # round-off of v, at most `SUM_ERROR` times that, is far below `ROUND_OFF` (|E| + b²).
    numbers = {path: bounded_decimal(value) for path, value in varied.items()}
    with np.errstate(all="ignore"):  # what is not finite proves nothing
        system = system_of(replaced(base, numbers), bounded_decimals)
        (weight,) = (e.weight for e in system.elements if isinstance(e, Gravity))
        stabilizers = [e for e in system.elements if isinstance(e, TranslationalStabilizer)]
        loaded = any(isinstance(e, (ConstantForce, LimitedForce)) for e in system.elements)
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
