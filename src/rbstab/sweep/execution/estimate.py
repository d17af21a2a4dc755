"""What a sweep is going to take, from a short calibration."""

import time
from collections.abc import Callable, Iterator
from itertools import cycle
from math import prod
from typing import NamedTuple

from rbstab.config.source import key_of
from rbstab.sweep.execution.single_run_pool import MIN_FOR_PROCESSES
from rbstab.sweep.folder.disk_space import sweep_bytes
from rbstab.sweep.members.engine import EngineFactory, MemberEngine
from rbstab.sweep.members.scipy_comparison import ENGINE, MEMBERS_PER_SAMPLE, is_comparable
from rbstab.sweep.members.single import SingleRuns
from rbstab.sweep.plan.axes import VARIANT
from rbstab.sweep.plan.plan import Plan

CALIBRATION = 3.0
"""s that a calibration may take, in parts for the variants; compiling comes on top."""

LOOKS = 256
"""Places of a plan that are looked at for the variants of their members."""

MIN_BLOCK = 64
"""Members: variants in shorter blocks are followed together, for pieces would hold several."""

PIECES = 4
"""Places of a variant that are followed before longer pieces: no odd one speaks for all."""

MAX_PIECES = 16
"""Places that are followed where there is no time for longer pieces."""

GROWTH = 4
"""How many times longer the pieces become: batches pay off only in long ones."""

GOLDEN = 0.6180339887498949
"""(√5 - 1)/2: its multiples, less their whole parts, are spread evenly however many there are."""

PIECE = 1024
"""Members that are followed together: their traces are in memory."""

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
    allows. Where variants alternate they are followed together.

    Args:
        plan: The plan.
        remaining: Members that are not done.
        factory: Makes the engine.
        threads: How many there will be.
        clock: Tells the time, s.
    """
    if not remaining:
        return Estimate(0.0, 0.0, 0, sweep_bytes(plan))
    engine, places, block = factory(plan), _places(plan), _block(plan)
    variants = _by_variant(plan, places)
    kinds = list(variants.values())
    if block < MIN_BLOCK:
        kinds, block = [places], plan.members
    each, calibrated = 0.0, plan.members
    for members in kinds:
        share = len(members) / LOOKS
        cost = _cost(engine, _Pieces(members, block), share * CALIBRATION, clock)
        each += share * cost.seconds
        calibrated = min(calibrated, cost.members)
    seconds = remaining * each / min(threads, remaining)
    return Estimate(
        seconds, _check_seconds(plan, variants, threads, clock), calibrated, sweep_bytes(plan)
    )


def _places(plan: Plan) -> list[int]:
    """Members from all over a plan; any number of the first ones are spread evenly."""
    return [int((k + 0.5) * GOLDEN % 1.0 * plan.members) for k in range(LOOKS)]


def _by_variant(plan: Plan, places: list[int]) -> dict[str, list[int]]:
    found: dict[str, list[int]] = {}
    for member in places:
        values = plan.values(member, member + 1, [key_of(VARIANT)])
        variant = plan.variant_of({key: column[0] for key, column in values.items()})
        found.setdefault(variant, []).append(member)
    return found


def _block(plan: Plan) -> int:
    """How many members of one variant stand side by side, from every multiple of it on."""
    axis = next((a for a in plan.axes for c in a.columns if c.path == VARIANT), None)
    if axis is None:
        return plan.members
    names, lengths = list(plan.dimensions), list(plan.dimensions.values())
    return prod(lengths[names.index(axis.name) + 1 :]) if axis.name in names else 1


class _Pieces(NamedTuple):
    """Where members are followed: around some places, inside their blocks."""

    places: list[int]
    block: int

    def starts(self, length: int) -> Iterator[int]:
        """Where pieces of a length start, without an end: places are used again."""
        for place in cycle(self.places):
            first = place // self.block * self.block
            yield min(place, first + self.block - length)


class _Cost(NamedTuple):
    """What a member takes, s, and how many members tell so."""

    seconds: float
    members: int


def _cost(engine: MemberEngine, pieces: _Pieces, allowed: float, clock: Clock) -> _Cost:
    """What a member takes, by the longest pieces that there is time for."""
    length, last = 1, pieces.places[-1]
    engine.compute(last, last + 1)  # whatever is made at the first use
    begin = clock()
    while True:
        seconds, left = 0.0, allowed
        for count, start in enumerate(pieces.starts(length), 1):
            seconds += _timed(engine, start, length, clock)
            left = allowed - (clock() - begin)
            time_for_longer = PIECES * GROWTH * seconds / count < left
            longer = time_for_longer and GROWTH * length <= pieces.block
            if left <= 0 or count == MAX_PIECES or (count >= PIECES and longer):
                break
        if left <= 0 or not longer:
            return _Cost(seconds / (count * length), count * length)
        length *= GROWTH


def _check_seconds(plan: Plan, variants: dict[str, list[int]], threads: int, clock: Clock) -> float:
    """What the comparison with single runs takes, by one member of each variant."""
    if plan.engine == ENGINE:
        return 0.0
    single, each = SingleRuns(plan, ENGINE), 0.0
    for variant, members in variants.items():
        if is_comparable(variant):
            each += len(members) / LOOKS * _timed(single, members[0], 1, clock)
    checked = -(-plan.members // MEMBERS_PER_SAMPLE)
    return checked * each / (threads if checked >= MIN_FOR_PROCESSES else 1)


def _timed(engine: MemberEngine, start: int, count: int, clock: Clock) -> float:
    begin, stop = clock(), start + count
    for first in range(start, stop, PIECE):
        engine.compute(first, min(first + PIECE, stop))
    return clock() - begin
