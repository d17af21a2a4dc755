"""A run with all that is known of it now: also what a proof decides that was stored after it."""

import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from rbstab.analysis.certificate.verdict import Check, Verdict
from rbstab.config.schema import Config
from rbstab.experiment.answers.run_answer import RunAnswer, answer_of
from rbstab.experiment.convergence.convergence import Convergence, stored_convergence
from rbstab.experiment.convergence.with_proof import with_later_proof
from rbstab.experiment.proof_cache import cached_proof
from rbstab.experiment.run_certificate import CERTIFIED_REGION
from rbstab.experiment.stored_run import certificate_lines
from rbstab.experiment.summary import (
    Summary,
    is_driven,
    settling_time_of,
    stores_v_minus_work,
    summary_of,
)
from rbstab.store.errors import StoreError
from rbstab.store.result import Result

if TYPE_CHECKING:
    from rbstab.experiment.disturbed.bound import Bound
    from rbstab.experiment.stored_proof.proof import Proof


class RegionCheck(NamedTuple):
    """The check of a start against its certified region.

    Attributes:
        inside: Whether the run starts inside.
        start: v(0) from the rest state of the region, J. (The stored v may count from another rest
            state, which the motion approaches.)
        level: The level of the region, J.
    """

    inside: bool
    start: float
    level: float


@dataclass(eq=False)
class AssessedRun:
    """A run. What follows from its result and its proof is found once, where it is needed first.

    Args:
        path: Its file.
        result: The content of the file.
        config: Its config; None if this version of the program cannot read it.
    """

    path: Path
    result: Result
    config: Config | None

    @cached_property
    def proof(self) -> "Proof | None":
        """The proof in its folder for its body, gravity and controller; None without one."""
        try:
            return None if self.config is None else cached_proof(self.path.parent, self.config)
        except StoreError:
            return None

    @cached_property
    def bound(self) -> "Bound | None":
        """What its folder has of the disturbances that its config states; None for nothing."""
        if self.config is None or self.config.bound is None:
            return None
        # Imported late: few configs state any.
        from rbstab.experiment.disturbed.stored import kept_bound

        try:
            return kept_bound(self.path.parent, self.config)
        except StoreError:
            return None

    @cached_property
    def now(self) -> Result:
        """Its result, with what the proof decides in its certificate and its attributes."""
        return with_later_proof(self.result, self.config, self.proof)

    @cached_property
    def answer(self) -> RunAnswer:
        """What is known about stability, and how surely."""
        return answer_of(self.now, self.config, self.proof, self.bound)

    @cached_property
    def checks(self) -> tuple[Check, ...]:
        """The checks of its certificate, also those that a later proof decides."""
        return tuple(certificate_lines(self.now))

    @cached_property
    def convergence(self) -> Convergence | None:
        """What is proved of the exact motion; None for an older result."""
        return stored_convergence(self.now.attributes)

    @cached_property
    def region(self) -> RegionCheck | None:
        """The check of the certified region; None if there is no region."""
        for line in self.checks:
            if line.check == CERTIFIED_REGION and not math.isnan(line.value):
                return RegionCheck(line.verdict == Verdict.CERTIFIED, line.value, line.bound)
        return None

    @cached_property
    def summary(self) -> Summary:
        """Its summary: first and last values of v, energy residual, peaks."""
        return summary_of(self.result)

    @cached_property
    def settling_time(self) -> float:
        """The time from which v stays below v(0)/1000, s; NaN if the run has not settled."""
        return settling_time_of(self.result)

    @cached_property
    def stores_v_minus_work(self) -> bool:
        """Whether the result stores v - ε in place of v (on s = F + κE)."""
        return stores_v_minus_work(self.result)

    @property
    def is_driven(self) -> bool:
        """Whether elements supply power to the body."""
        return is_driven(self.result)

    def attribute(self, name: str) -> str:
        """Return an attribute of the result as text; "" if it is missing."""
        return str(self.result.attributes.get(name, ""))
