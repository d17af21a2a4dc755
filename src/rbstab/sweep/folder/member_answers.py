"""For how many members of a finished sweep is it proved, or seen, that they come to rest?"""

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rbstab.analysis.lyapunov import ENERGY_SCALE
from rbstab.config.user_code.permission import has_code
from rbstab.experiment.answers.facts import Fact, Shown
from rbstab.experiment.answers.rounded import NO_VALUE, number
from rbstab.experiment.answers.words import Sureness
from rbstab.experiment.convergence.decisions import not_enclosed
from rbstab.files.text import grouped
from rbstab.integrate.status import RunStatus
from rbstab.mechanics.numbers import Array
from rbstab.store.table import Table
from rbstab.store.variables import RUN, safe_name
from rbstab.sweep.folder.disturbed import DisturbedAnswers, disturbed_answers
from rbstab.sweep.folder.members_file import (
    RELATIVE_RESIDUAL,
    counts_by,
    counts_by_status,
    relative_residuals,
)
from rbstab.sweep.folder.outcomes import (
    READ,
    SPEEDS,
    SweepOutcomes,
    outcomes_of,
    plan_of,
    with_outcomes,
)
from rbstab.sweep.folder.sweep_folder import resuming_command
from rbstab.sweep.folder.sweep_table import read_sweep
from rbstab.sweep.members.outcome import STATUSES
from rbstab.sweep.plan.plan import Plan
from rbstab.sweep.proofs.columns import CONVERGENCE, FALSE, NO_PROOF, NOT_PROVED, PROVED
from rbstab.sweep.proofs.convergence import PROOF_COLUMNS, ProvedConvergence, convergence_now
from rbstab.sweep.proofs.sole_state import SoleState, sole_state_of
from rbstab.sweep.proofs.variants import members_of_variants, without_theorem

MAX_COUNTED = 2_000_000
"""Members are compared with later proofs up to this number. A million take some 5 seconds."""

NOT_MADE = "the proof of their own body was not made, or ended early; make it: {}"
"""Why there is no proof of members that one could cover, and the command that makes it."""


class MemberAnswers(NamedTuple):
    """The members of a sweep by what is known of them now.

    Attributes:
        members: The number of members. The next four add up to it.
        proved: Proved to converge to a rest state.
        false: Proved not to come to rest.
        seen: At rest by the end of their computed run, and not proved.
        not_decided: The others.
        settled: At rest by the end of their computed run, whether proved or not.
        completed: Those whose run completed.
        without_proof: By the reason: how many members no proof covers.
        sole_state: Which bodies have one rest state, by any proof.
        as_finished: Whether proofs that were made after the sweep was finished are not counted.
        outcomes: What became of the members.
        summary: The same in a few numbers, for JSON: `by_status` and `convergence` by word;
            `settling_median` of those that settled, s; `worst_residual`, the largest |r| of the
            completed members over their largest energy; NaN if there is none.
        disturbed: How far disturbances tilt them, if the plan states a bound.
        provable: The first member that is only seen, and whose exact motion was not enclosed, but
            can be: a single run may prove it. None if there is none.
    """

    members: int
    proved: int
    false: int
    seen: int
    not_decided: int
    settled: int
    completed: int
    without_proof: dict[str, int]
    outcomes: SweepOutcomes
    summary: dict[str, Any]
    sole_state: SoleState = SoleState()
    as_finished: bool = False
    disturbed: DisturbedAnswers | None = None
    provable: int | None = None

    @property
    def any_proof(self) -> bool:
        """Whether there is a proof of some members, whatever it says."""
        return sum(self.without_proof.values()) < self.members

    @property
    def by_word(self) -> dict[str, int]:
        """The number of members with each answer."""
        return {
            str(Sureness.PROVED): self.proved,
            str(Sureness.FALSE): self.false,
            str(Sureness.SEEN): self.seen,
            str(Sureness.NOT_DECIDED): self.not_decided,
        }


def read_answers(file: Path) -> Table:
    """Return the columns of a sweep that `member_answers` needs, with the outcomes.

    Raises:
        StoreError: The file cannot be read, or is damaged.
    """
    plan = plan_of(read_sweep(file, ()))
    varied = [] if plan is None else [safe_name(varied.key) for varied in plan.varied_keys]
    columns = (*READ, *SPEEDS, *RELATIVE_RESIDUAL, *PROOF_COLUMNS, "peak_tilt", *varied)
    return with_outcomes(read_sweep(file, columns), plan)


def member_answers(file: Path, read: Callable[[Path], Table] = read_answers) -> MemberAnswers:
    """Return what is known of the members of a sweep, with the proofs that lie beside it now.

    Args:
        file: The members file of the sweep.
        read: Reads it; `read_answers`, perhaps in another process.

    Raises:
        StoreError: The file cannot be read, or is damaged.
    """
    table = read(file)
    members = len(table[RUN])
    plan = plan_of(table)
    many = members > MAX_COUNTED
    later = plan is not None and not many
    proofs = ProvedConvergence(plan, file.absolute().parent.parent) if plan and later else None
    convergence = convergence_now(table, proofs)
    codes = convergence.codes
    completed = table["status"] == STATUSES.index(RunStatus.COMPLETED)
    settled = completed & np.isfinite(table["settling_time"])
    decided = (codes == PROVED) | (codes == FALSE)
    # A proof of their body exists, so that a proof of their motion takes least time.
    first, then = (_first_enclosable(plan, settled & (codes == c)) for c in (NOT_PROVED, NO_PROOF))
    return MemberAnswers(
        members=members,
        proved=_count(codes == PROVED),
        false=_count(codes == FALSE),
        seen=_count(settled & ~decided),
        not_decided=_count(~settled & ~decided),
        settled=_count(settled),
        completed=_count(completed),
        without_proof=_without_proof(plan, codes == NO_PROOF, file.parent),
        outcomes=outcomes_of(table, plan, codes == PROVED),
        summary=_summary(table, completed, settled),
        sole_state=SoleState() if proofs is None else sole_state_of(proofs, convergence),
        as_finished=many,
        disturbed=None if plan is None or many else disturbed_of(plan, table, file),
        provable=then if first is None else first,
    )


def disturbed_of(plan: Plan, table: Table, file: Path) -> DisturbedAnswers | None:
    """Return how far disturbances tilt the members of a sweep; None if its plan states no bound.

    Args:
        plan: The plan.
        table: Its table, with `status`, `end_time`, and `peak_tilt` if it has that column.
        file: Its members file.
    """
    not_made = NOT_MADE.format(proving_command(file.parent, plan))
    return disturbed_answers(plan, table, file.absolute().parent.parent, not_made)


def _summary(table: Table, completed: Array, settled: Array) -> dict[str, Any]:
    times, residuals = table["settling_time"][settled], relative_residuals(table)[completed]
    stored = table["convergence"]
    return {
        "members": len(stored),
        "by_status": counts_by_status(np.bincount(table["status"])),
        "settled": len(times),
        "settling_median": float(np.median(times)) if len(times) else float("nan"),
        "worst_residual": float(residuals.max()) if len(residuals) else float("nan"),
        "convergence": counts_by(CONVERGENCE, np.bincount(stored)) if stored.any() else {},
    }


def _count(mask: Array) -> int:
    return int(np.count_nonzero(mask))


def _first_enclosable(plan: Plan | None, members: Array) -> int | None:
    """Return the first of some members whose exact motion can be enclosed; None without one."""
    # The plan cannot be read.
    if plan is None:
        return None
    enclosable = [
        variant
        for variant in plan.variants
        if not has_code(plan.base_of(variant))
        and not not_enclosed(plan.initial_value_problems[variant])
    ]
    members = members & members_of_variants(plan, enclosable)
    return int(np.flatnonzero(members)[0]) if members.any() else None


def _without_proof(plan: Plan | None, missing: Array, folder: Path) -> dict[str, int]:
    """Return how many members no proof covers, by the reason."""
    if not missing.any():
        return {}
    if plan is None:
        return {"this version cannot read the plan": _count(missing)}
    counts: dict[str, int] = {}
    for reason, uncovered in without_theorem(plan).items():
        counts[reason] = _count(missing & uncovered)
        missing = missing & ~uncovered
    counts[NOT_MADE.format(proving_command(folder, plan))] = _count(missing)
    return {reason: count for reason, count in counts.items() if count}


def proving_command(folder: Path, plan: Plan | None) -> str:
    """Return the command that makes the missing proofs of a sweep.

    Args:
        folder: The folder of the sweep.
        plan: Its plan; None if it cannot be read.
    """
    runs_code = plan is not None and any(map(has_code, plan.bases.values()))
    return f"{resuming_command(folder)} --prove{' --allow-python' if runs_code else ''}"


_FACTS: tuple[Fact[MemberAnswers], ...] = (
    Fact("outcome", "", lambda answers: answers.outcomes.brief),
    Fact("decides", "", lambda answers: answers.outcomes.deciding or NO_VALUE),
    Fact("members", "", lambda answers: grouped(answers.members)),
    Fact("settled", "", lambda answers: grouped(answers.settled)),
    Fact(
        "settling time, median of those settled",
        "s",
        lambda answers: answers.summary["settling_median"],
    ),
    Fact(
        f"largest |r|/{ENERGY_SCALE}",
        "",
        lambda answers: Shown(
            number(answers.summary["worst_residual"], 2), answers.summary["worst_residual"]
        ),
    ),
)
SWEEP_FACTS = {fact.name: fact for fact in _FACTS}
"""The facts about the members of a sweep by their names."""
