"""The margin of a start: v(0) over the level c* of the region that it is compared with."""

import math
from typing import NamedTuple

from rbstab.experiment.answers.run_answer import SAME_START
from rbstab.experiment.convergence.zero_description import is_below_end
from rbstab.report.runs.facts import RunFacts


class Margin(NamedTuple):
    """v(0) and the level of a certified region, J, both from the same rest state."""

    start: float
    level: float

    @property
    def ratio(self) -> float:
        """v(0)/c*: below 1, the start is inside; above 1 nothing follows."""
        return self.start / self.level


def margin_of(facts: RunFacts) -> Margin | None:
    """Return v(0) and the level with which it is compared; None if no finite level is proved.

    It is the region that contains the start, or that proves convergence (perhaps that of all θ1 and
    θ3), or else that of the lowest rest state. Where every start converges there is no level.
    """
    region, found = facts.region, facts.convergence
    if region is not None and region.inside:
        return _margin(region.start, region.level)
    if found is None or not found.proved or found.bound is None:
        return None if region is None else _margin(region.start, region.level)
    if region is not None and found.rest_state == 1:
        return _margin(region.start, found.bound)
    # The stored v counts from the rest state below the end of the motion, if it says so.
    if not is_below_end(facts.attribute("lyapunov_zero")):
        return None
    return _margin(facts.run.summary.lyapunov_start, found.bound)


def counts_from_other_state(margin: Margin | None, facts: RunFacts) -> bool:
    """Return whether the v(0) of a margin counts from another rest state than that of the run."""
    own = facts.run.summary.lyapunov_start
    return margin is not None and not math.isclose(margin.start, own, rel_tol=SAME_START)


def _margin(start: float, level: float) -> Margin | None:
    return Margin(start, level) if 0.0 < level < math.inf and math.isfinite(start) else None
