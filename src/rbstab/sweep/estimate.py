"""What a sweep is going to take, from a short calibration."""

import time
from typing import NamedTuple

from rbstab.sweep.check import ENGINE, SHARE
from rbstab.sweep.engine import EngineFactory, MemberEngine
from rbstab.sweep.layout import OUTCOME, varied_layout
from rbstab.sweep.plan import Plan
from rbstab.sweep.processes import WORTH_IT
from rbstab.sweep.single import SingleRuns

CALIBRATION = 0.5
"""s: a part of the members is large enough when it takes this long."""

_NUMBER = 8
"""Bytes of the number of a member."""


class Estimate(NamedTuple):
    """What remains of a sweep.

    seconds are those of the members on the given number of threads, check_seconds those of the
    comparison with single runs; bytes is what the whole sweep takes on the disk.
    """

    seconds: float
    check_seconds: float
    bytes: int


def estimate(plan: Plan, remaining: int, factory: EngineFactory, threads: int) -> Estimate:
    """Follows some members from the middle of a plan, and tells what the rest will take.

    Args:
        plan: The plan.
        remaining: Members that are not done.
        factory: Makes the engine.
        threads: How many there will be.
    """
    if not remaining:
        return Estimate(0.0, 0.0, bytes_of(plan))
    seconds = remaining * _seconds_per_member(plan, factory(plan)) / min(threads, remaining)
    check_seconds = 0.0
    if plan.engine != ENGINE:
        single = _timed(SingleRuns(plan, ENGINE), plan.members // 2, 1)
        checked = -(-plan.members // SHARE)
        check_seconds = single * checked / (threads if checked >= WORTH_IT else 1)
    return Estimate(seconds, check_seconds, bytes_of(plan))


def bytes_of(plan: Plan) -> int:
    """What a sweep takes on the disk: its shards, and the file that gathers them."""
    kept, varied = (
        sum(column.size for column in layout.values()) for layout in (OUTCOME, varied_layout(plan))
    )
    return plan.members * (2 * (kept + _NUMBER) + varied)


def _seconds_per_member(plan: Plan, engine: MemberEngine) -> float:
    middle, count = plan.members // 2, 1
    _timed(engine, middle, 1)  # whatever is made at the first use
    while True:
        count = min(count, plan.members - middle)
        seconds = _timed(engine, middle, count)
        if seconds > CALIBRATION or count == plan.members - middle:
            return seconds / count
        count *= 4


def _timed(engine: MemberEngine, start: int, count: int) -> float:
    begin = time.perf_counter()
    engine.compute(start, start + count)
    return time.perf_counter() - begin
