"""What a sweep is going to take, from a short calibration."""

import time
from collections.abc import Callable
from itertools import cycle
from typing import NamedTuple

from rbstab.config.source import key_of
from rbstab.sweep.axes import VARIANT
from rbstab.sweep.check import ENGINE, SHARE, is_comparable
from rbstab.sweep.engine import EngineFactory, MemberEngine
from rbstab.sweep.layout import OUTCOME, varied_layout
from rbstab.sweep.plan import Plan
from rbstab.sweep.single import SingleRuns

CALIBRATION = 3.0
"""s that a calibration may take, in equal parts for the variants; compiling comes on top."""

LOOKS = 256
"""Places of a plan that are looked at for the variants of their members."""

PIECES = 4
"""Places of a variant that are followed before longer pieces: no odd one speaks for all."""

MOST_PIECES = 16
"""Places that are followed where there is no time for longer pieces."""

GROWTH = 4
"""How many times longer the pieces become: batches pay off only in long ones."""

GOLDEN = 0.6180339887498949
"""(√5 - 1)/2: its multiples, less their whole parts, are spread evenly however many there are."""

_NUMBER = 8
"""Bytes of the number of a member."""

Clock = Callable[[], float]


class Estimate(NamedTuple):
    """What remains of a sweep.

    seconds are those of the members on the given number of threads; check_seconds those of the
    comparison with single runs; calibrated is how many members of a variant both rest on, at least;
    bytes is what the whole sweep takes on the disk.
    """

    seconds: float
    check_seconds: float
    calibrated: int
    bytes: int


def estimate(
    plan: Plan,
    remaining: int,
    factory: EngineFactory,
    threads: int,
    clock: Clock = time.perf_counter,
) -> Estimate:
    """Follows some members of each variant, from all over the plan; tells what the rest will take.

    Two members of each variant are followed, whatever they take; more as long as `CALIBRATION`
    allows.

    Args:
        plan: The plan.
        remaining: Members that are not done.
        factory: Makes the engine.
        threads: How many there will be.
        clock: Tells the time, s.
    """
    if not remaining:
        return Estimate(0.0, 0.0, 0, bytes_of(plan))
    engine, single, kinds = factory(plan), SingleRuns(plan, ENGINE), _places(plan)
    looks = sum(map(len, kinds.values()))
    checks = -(-plan.members // SHARE) if plan.engine != ENGINE else 0
    each, check_each, calibrated = 0.0, 0.0, plan.members
    for variant, places in kinds.items():
        share = len(places) / looks
        cost = _cost(plan, engine, places, CALIBRATION / len(kinds), clock)
        each += share * cost.seconds
        calibrated = min(calibrated, cost.members)
        if checks and is_comparable(variant):
            check_each += share * _timed(single, places[0], 1, clock)
    seconds = remaining * each / min(threads, remaining)
    return Estimate(seconds, checks * check_each, calibrated, bytes_of(plan))


def bytes_of(plan: Plan) -> int:
    """What a sweep takes on the disk: its shards, and the file that gathers them."""
    kept, varied = (
        sum(column.size for column in layout.values()) for layout in (OUTCOME, varied_layout(plan))
    )
    return plan.members * (2 * (kept + _NUMBER) + varied)


class _Cost(NamedTuple):
    """What a member takes, s, and how many members tell so."""

    seconds: float
    members: int


def _places(plan: Plan) -> dict[str, list[int]]:
    """Members from all over a plan by their variants; any number of the first ones are spread."""
    looks = [int((k + 0.5) * GOLDEN % 1.0 * plan.members) for k in range(LOOKS)]
    found: dict[str, list[int]] = {}
    for member in dict.fromkeys(looks):
        found.setdefault(_variant(plan, member), []).append(member)
    return found


def _variant(plan: Plan, member: int) -> str:
    values = plan.values(member, member + 1, [key_of(VARIANT)])
    return plan.variant_of({key: column[0] for key, column in values.items()})


def _piece(plan: Plan, place: int, length: int) -> int:
    """Where a piece starts that holds a member, and none of another variant if that can be."""
    last = plan.members - length
    starts = min(place, last), max(place - length + 1, 0)
    for start in starts:
        ends = {_variant(plan, member) for member in (start, place, start + length - 1)}
        if len(ends) == 1:
            return start
    return starts[0]


def _cost(
    plan: Plan, engine: MemberEngine, places: list[int], allowed: float, clock: Clock
) -> _Cost:
    """What a member of one variant takes, by the longest pieces that there is time for."""
    engine.compute(places[0], places[0] + 1)  # whatever is made at the first use
    begin, length = clock(), 1
    # Places are used again where there are few.
    turns = cycle([*places[1:], places[0]])
    while True:
        seconds, pieces = 0.0, 0
        while pieces < MOST_PIECES:
            seconds += _timed(engine, _piece(plan, next(turns), length), length, clock)
            pieces += 1
            left = allowed - (clock() - begin)
            longer = PIECES * GROWTH * seconds / pieces < left and GROWTH * length <= plan.members
            if left <= 0 or (pieces == PIECES and longer):
                break
        if left <= 0 or not longer:
            return _Cost(seconds / (pieces * length), pieces * length)
        length *= GROWTH


def _timed(engine: MemberEngine, start: int, count: int, clock: Clock) -> float:
    begin = clock()
    engine.compute(start, start + count)
    return clock() - begin
