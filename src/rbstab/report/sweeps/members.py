"""The members of a sweep as a report needs them: what is varied, and how they ended."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from rbstab.config.errors import ConfigError
from rbstab.config.source import parse_source
from rbstab.mechanics.numbers import Array
from rbstab.report.sweeps.parameters import Parameter, parameters_of
from rbstab.store.errors import NotAResultError
from rbstab.store.table import RUN, Table
from rbstab.store.table_file import read_table
from rbstab.sweep.folder.layout import safe_name
from rbstab.sweep.members.convergence import NO_PROOF, ProvedConvergence
from rbstab.sweep.members.outcome import STATUSES
from rbstab.sweep.plan.load import load_plan
from rbstab.sweep.plan.plan import Plan

COLUMNS = (
    "run_id",
    "status",
    "lyapunov_start",
    "energy_residual",
    "peak_contact_displacement",
    "peak_orientation",
    "smallest_regularity",
    "settling_time",
    "displacement_settling_time",
    "convergence",
    "steps",
)
"""What is read of every member beside what is varied; a sweep is read in part, for it is large."""

SETTLED, UNSETTLED = "settled", "not settled"

ENDS = (SETTLED, UNSETTLED, *map(str, STATUSES[1:]))
"""How a member can end: its status, `completed` in two parts, by whether it has settled."""


@dataclass(frozen=True, eq=False)
class Members:
    """The members of a sweep.

    Args:
        table: Their columns (`COLUMNS`, and what is varied).
        plan: The plan; None where this version of the program cannot read it.
        results: The folder of results, where proofs are kept.
    """

    table: Table
    plan: Plan | None
    results: Path

    def __len__(self) -> int:
        return len(self.table["status"])

    def column(self, name: str) -> Array:
        """The data of a column, the first axis along members."""
        found: Array = self.table[name]
        return found

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """What is varied and has more than one value."""
        return parameters_of(self.plan, self.table) if self.plan is not None else ()

    @cached_property
    def ends(self) -> Array:
        """How each has ended, as its place in `ENDS`, shape (n,)."""
        status = self.column("status")
        unsettled = (status > 0) | ~np.isfinite(self.column("settling_time"))
        return status + unsettled.astype(np.int8)

    @cached_property
    def counts(self) -> Array:
        """How many have ended in each way of `ENDS`."""
        return np.bincount(self.ends, minlength=len(ENDS))

    @property
    def completed(self) -> Array:
        """Which of them completed, shape (n,)."""
        return self.column("status") == 0

    @cached_property
    def levels(self) -> dict[str, float]:
        """v below which convergence is proved, J, by variant, of those of which it is known."""
        if self._certified is None:
            return {}
        return {v: level for v, level in self._certified.bounds.items() if level is not None}

    @property
    def share_proofs(self) -> bool:
        """Whether members differ in their start alone, so that one proof is about all of them."""
        return self.plan is not None and all(
            column.path[0] == "initial"
            for variant in self.plan.variants
            for column in self.plan.columns_of(variant)
        )

    @cached_property
    def level(self) -> Array | None:
        """v below which the convergence of each is proved, shape (n,), NaN: unknown; J."""
        if not self.levels or self.plan is None:
            return None
        by_code = np.array([self.levels.get(name, np.nan) for name in self.plan.variants])
        if "controller_variant" in self.table.layout:
            return by_code[self.column("controller_variant")]
        return np.broadcast_to(by_code[0], (len(self),))

    @cached_property
    def convergence(self) -> Array:
        """What is known of the convergence of each, as its place in `certified.CONVERGENCE`."""
        if self.levels and self._certified is not None:
            return self._certified.of(0, len(self), self.column("lyapunov_start"))
        if "convergence" in self.table.layout:
            return self.column("convergence")
        return np.full(len(self), NO_PROOF, dtype=np.int8)

    @cached_property
    def _certified(self) -> ProvedConvergence | None:
        return ProvedConvergence(self.plan, self.results) if self.plan is not None else None


def read_members(path: Path) -> Members:
    """Reads what a report needs of the file of a sweep.

    Raises:
        NotAResultError: It is damaged, or no sweep.
        StoreError: It cannot be read.
    """
    plan = _plan_of(read_table(path, ()))
    varied = [safe_name(column.key) for column in plan.columns] if plan is not None else []
    table = read_table(path, (*varied, *COLUMNS))
    missing = [name for name in COLUMNS if name not in table.layout and name != "convergence"]
    if missing:
        raise NotAResultError(f"{path} has no column {missing[0]}")
    if plan is not None and (plan.members != len(table[RUN]) or not {*varied} <= {*table.layout}):
        plan = None
    return Members(table, plan, path.absolute().parent.parent)


def _plan_of(table: Table) -> Plan | None:
    """The plan that a table has within itself."""
    try:
        return load_plan(parse_source(str(table["plan"]), "plan").data)
    except (ConfigError, KeyError):
        return None
