"""The members of a sweep, as read for a report: parameters and outcomes."""

from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path

import numpy as np

from rbstab.config.build import supplies_power
from rbstab.config.numbers import is_of_initial_state
from rbstab.experiment.answers.outcome import KINDS
from rbstab.mechanics.numbers import Array
from rbstab.report.model.palette import BAD, GOOD, SECOND, THIRD, UNKNOWN, UNTRIED
from rbstab.report.sweeps.parameters import Parameter, parameters_of
from rbstab.store.table import Table
from rbstab.store.variables import safe_name
from rbstab.sweep.folder.disturbed import DisturbedAnswers
from rbstab.sweep.folder.member_answers import disturbed_of
from rbstab.sweep.folder.outcomes import SPEEDS, SweepOutcomes, outcomes_of, plan_of, with_outcomes
from rbstab.sweep.folder.sweep_table import read_sweep
from rbstab.sweep.plan.plan import Plan
from rbstab.sweep.proofs.columns import PROVED
from rbstab.sweep.proofs.convergence import (
    MemberConvergence,
    ProvedConvergence,
    convergence_now,
)
from rbstab.sweep.proofs.sole_state import SoleState, sole_state_of
from rbstab.sweep.proofs.variants import without_theorem

COLUMNS = (
    "status",
    "lyapunov_start",
    "energy_residual",
    "energy_scale",
    "peak_contact_displacement",
    "peak_tilt",
    "smallest_regularity",
    "settling_time",
    "end_time",
    "final_orientation",
    "displacement_settling_time",
    "convergence",
    "proved_rest_state",
    "one_rest_state",
    "proved_time",
    "motion_proof",
    "energy_at_rest",
    "rest_orientation",
    "rest_unstable",
    *SPEEDS,
)
"""Columns to read besides the parameters; all columns of a sweep could need too much memory."""

RETURNS, RESTS_ELSEWHERE, UNSTABLE, MOVING, LEFT_RANGE, FAILED = range(len(KINDS))
"""The codes of the outcomes of members."""

OUTCOMES = tuple(kind.words for kind in KINDS)
"""The words of the outcomes, by their codes."""

OUTCOME_COLOURS = (GOOD, BAD, SECOND, UNTRIED, THIRD, UNKNOWN)
"""Numbers of the colours of outcomes in the palette: green is only for members that return."""


@dataclass(frozen=True, eq=False)
class Members:
    """The members of a sweep.

    Args:
        table: The columns in `COLUMNS`, and those of the parameters.
        plan: The plan; None if this version of the program cannot read it.
        file: The members file of the sweep.
    """

    table: Table
    plan: Plan | None
    file: Path

    def __len__(self) -> int:
        return len(self.table["status"])

    def column(self, name: str) -> Array:
        """Return the data of a column, with the members along the first axis."""
        data: Array = self.table[name]
        return data

    @cached_property
    def driven(self) -> bool:
        """Whether inputs, or elements of users, supply power to the members."""
        return self.plan is not None and any(map(supplies_power, self.plan.bases.values()))

    @property
    def is_drawn(self) -> bool:
        """Whether the members are drawn by a design, and not chosen as a grid."""
        return self.plan is not None and self.plan.design is not None

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """The parameters with more than one value."""
        return parameters_of(self.plan, self.table) if self.plan is not None else ()

    @property
    def outcomes(self) -> Array:
        """The outcome of each member, as its index in `OUTCOMES`, shape (n,)."""
        return self.column("outcome")

    @property
    def at_rest(self) -> Array:
        """Boolean mask of the members at rest at the end of their runs, shape (n,)."""
        return np.isin(self.outcomes, (RETURNS, RESTS_ELSEWHERE, UNSTABLE))

    @cached_property
    def sweep_outcomes(self) -> SweepOutcomes:
        """What became of the members, how surely, and which parameter decides."""
        return outcomes_of(self.table, self.plan, self.convergence == PROVED)

    @cached_property
    def outcome_counts(self) -> Array:
        """The number of members with each outcome, in the order of `OUTCOMES`."""
        return np.bincount(self.outcomes, minlength=len(OUTCOMES))

    @cached_property
    def undecidable(self) -> dict[str, Array]:
        """Members that no theorem covers: a mask of shape (n,) by the reason."""
        return {} if self.plan is None else without_theorem(self.plan)

    @property
    def completed(self) -> Array:
        """Boolean mask of the completed members, shape (n,)."""
        return self.column("status") == 0

    @property
    def share_rest_states(self) -> bool:
        """Whether members have the same body, gravity, controller and elements.

        Without a plan that can be read, nothing is known to differ.
        """
        if self.plan is None:
            return True
        keys = self.plan.varied_keys
        return len(self.plan.variants) < 2 and all(is_of_initial_state(key.path) for key in keys)

    @cached_property
    def level(self) -> Array | None:
        """c* of each member, J, shape (n,), NaN if unknown; None without any proof.

        Members with v(0) < c* are proved to converge to the lowest rest state.
        """
        bounds = {} if self._certified is None else self._certified.bounds
        if not bounds or self.plan is None:
            return None
        # The energy of the rest state at which v of each member is zero.
        rest = self.column("energy_at_rest")
        variants = np.zeros(len(self), dtype=int)
        if "controller_variant" in self.table:
            variants = self.column("controller_variant")
        levels = np.full(len(self), np.nan)
        for k, name in enumerate(self.plan.variants):
            if name in bounds:
                of_variant = variants == k
                levels[of_variant] = bounds[name] - rest[of_variant]
        return levels

    @cached_property
    def convergence(self) -> Array:
        """The proved convergence of each member, as its index in `convergence.CONVERGENCE`."""
        return self._proved.codes

    @cached_property
    def proved_rest_states(self) -> Array:
        """The number of the rest state to which each member is proved to converge; 0: not proved.

        Sweeps of older versions have no such column. Their proved members converge to the lowest.
        """
        return self._proved.rest_states

    @cached_property
    def sole_state(self) -> SoleState:
        """Which distinct bodies have one rest state, by any proof."""
        if self._certified is None:
            return SoleState()
        return sole_state_of(self._certified, self._proved)

    @property
    def box_levels(self) -> Array:
        """The level, J, that proofs for many bodies at once give for each member; 0: none, (n,)."""
        if self._certified is None:
            return np.zeros(len(self))
        return self._certified.boxes.of(0, len(self))[0]

    @cached_property
    def disturbed(self) -> DisturbedAnswers | None:
        """How far disturbances tilt the members; None if the plan states no bound."""
        return None if self.plan is None else disturbed_of(self.plan, self.table, self.file)

    @cached_property
    def _proved(self) -> MemberConvergence:
        """What is proved of the members: the stored columns, and more by proofs made since."""
        return convergence_now(self.table, self._certified)

    @cached_property
    def _certified(self) -> ProvedConvergence | None:
        results = self.file.absolute().parent.parent
        return ProvedConvergence(self.plan, results) if self.plan is not None else None


def read_members(path: Path) -> Members:
    """Read from the file of a sweep the columns that a report needs.

    Raises:
        NotAResultError: A file is damaged, or is not a sweep.
        StoreError: The file cannot be read.
    """
    plan = plan_of(read_sweep(path, ()))
    varied = [safe_name(column.key) for column in plan.varied_keys] if plan is not None else []
    table = read_sweep(path, (*varied, *COLUMNS))
    if not {*varied} <= {*table}:
        plan = None
    return Members(with_outcomes(table, plan), plan, path)


kept = lru_cache(maxsize=1)
"""Decorates a function of members: its value, which nobody changes, is that of the last sweep."""
