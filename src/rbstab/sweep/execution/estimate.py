"""Estimate the time and disk space of a sweep from a short calibration."""

import time
from collections.abc import Callable, Iterator
from itertools import cycle
from math import prod
from typing import NamedTuple

from rbstab.config.source import key_of
from rbstab.sweep.folder.disk_space import sweep_bytes
from rbstab.sweep.members.engine import EngineFactory, MemberEngine
from rbstab.sweep.members.scipy_comparison import ENGINE, members_to_compare
from rbstab.sweep.members.single import SingleRuns
from rbstab.sweep.plan.axes import VARIANT
from rbstab.sweep.plan.plan import Plan
from rbstab.sweep.proofs.convergence import shares_proof

CALIBRATION_TIME = 3.0
"""s; the limit of a calibration, divided among the variants, without compilation."""

SAMPLED_MEMBERS = 256
"""Members sampled to find the share of each variant."""

PROVED_MEMBERS = 16
"""Largest number of members whose proofs are timed, if each is enclosed by itself."""

JOINT_MEMBERS = 64
"""Members of the block whose proofs are timed, if they are enclosed together. The larger blocks of
a sweep are faster, so the estimate is somewhat high."""

MIN_BLOCK = 64
"""Members. Variants in shorter blocks are timed together: a piece would contain several."""

MIN_PIECES = 4
"""Pieces timed before longer ones are tried, so that no single piece decides the estimate."""

MAX_PIECES = 16
"""Largest number of pieces of one length; used if there is no time for longer pieces."""

GROWTH = 4
"""Factor between successive piece lengths. Batches are efficient only in long pieces."""

GOLDEN_RATIO = 0.6180339887498949
"""(√5 - 1)/2. The fractional parts of its multiples are spread evenly, for any number of them."""

BATCH_SIZE = 1024
"""Members that are computed in one call, to limit the memory of their traces."""

Clock = Callable[[], float]


class Estimate(NamedTuple):
    """Estimated cost of the rest of a sweep.

    Args:
        seconds: Time of the members, on the given number of threads, s. It includes their proofs.
        check_seconds: Time of the comparison with SciPy, s.
        calibrated: The number of members timed, for the variant with the fewest.
        bytes: Disk space of the whole sweep.
    """

    seconds: float
    check_seconds: float
    calibrated: int
    bytes: int


def estimate(  # noqa: PLR0913 (a sweep and how it is run)
    plan: Plan,
    remaining: int,
    factory: EngineFactory,
    threads: int,
    clock: Clock = time.perf_counter,
    *,
    compare: int | None = None,
) -> Estimate:
    """Time some members of each variant, spread over the plan, and estimate the rest.

    At least two members of each variant are computed, and more while `CALIBRATION_TIME` allows it.
    Variants that alternate in short blocks are timed together.

    Args:
        plan: The plan.
        remaining: The number of members that are not done.
        factory: Makes the engine.
        threads: The number of threads of the sweep.
        clock: Returns the time, s.
        compare: The number of members to compare with SciPy (see `members_to_compare`).
    """
    if not remaining:
        return Estimate(0.0, 0.0, 0, sweep_bytes(plan))
    engine, sample, block = factory(plan), _sample(plan), _block_length(plan)
    variants = _by_variant(plan, sample)
    groups = list(variants.values())
    if block < MIN_BLOCK:
        groups, block = [sample], plan.members
    seconds_per_member, calibrated = 0.0, plan.members
    for members in groups:
        share = len(members) / SAMPLED_MEMBERS
        cost = _measure(engine, _Pieces(members, block), share * CALIBRATION_TIME, clock)
        seconds_per_member += share * cost.seconds
        calibrated = min(calibrated, cost.members)
    seconds_per_member += _proof_time(plan, clock)
    seconds = remaining * seconds_per_member / min(threads, remaining)
    compared = members_to_compare(plan, compare)
    check_seconds = _comparison_time(plan, compared, threads, clock)
    return Estimate(seconds, check_seconds, calibrated, sweep_bytes(plan))


def _sample(plan: Plan) -> list[int]:
    """Return members spread evenly over a plan; so are the first k of them, for every k."""
    return [int((k + 0.5) * GOLDEN_RATIO % 1.0 * plan.members) for k in range(SAMPLED_MEMBERS)]


def _by_variant(plan: Plan, sample: list[int]) -> dict[str, list[int]]:
    found: dict[str, list[int]] = {}
    for member in sample:
        values = plan.values(member, member + 1, [key_of(VARIANT)])
        variant = plan.variant_of({key: entries[0] for key, entries in values.items()})
        found.setdefault(variant, []).append(member)
    return found


def _block_length(plan: Plan) -> int:
    """Return the length of the blocks of consecutive members that have the same variant."""
    axis = next((a for a in plan.axes for k in a.varied_keys if k.path == VARIANT), None)
    if axis is None:
        return plan.members
    names, lengths = list(plan.dimensions), list(plan.dimensions.values())
    return prod(lengths[names.index(axis.name) + 1 :]) if axis.name in names else 1


class _Pieces(NamedTuple):
    """Pieces of a plan to be timed: each lies at a sampled member, inside the member's block."""

    members: list[int]
    block: int

    def starts(self, length: int) -> Iterator[int]:
        """Yield the starts of pieces of this length, repeated without end."""
        for member in cycle(self.members):
            first = member // self.block * self.block
            yield min(member, first + self.block - length)


class _Cost(NamedTuple):
    """The measured time of one member, s, and the number of members it is averaged over."""

    seconds: float
    members: int


def _measure(engine: MemberEngine, pieces: _Pieces, allowed: float, clock: Clock) -> _Cost:
    """Measure the time of one member, in the longest pieces that fit into the allowed time, s."""
    length, last = 1, pieces.members[-1]
    engine.compute(last, last + 1)  # warm-up: compilation and caches
    begin = clock()
    while True:
        seconds, left = 0.0, allowed
        for count, start in enumerate(pieces.starts(length), 1):
            seconds += _time(engine, start, length, clock)
            left = allowed - (clock() - begin)
            time_for_longer = MIN_PIECES * GROWTH * seconds / count < left
            longer = time_for_longer and GROWTH * length <= pieces.block
            if left <= 0 or count == MAX_PIECES or (count >= MIN_PIECES and longer):
                break
        if left <= 0 or not longer:
            return _Cost(seconds / (count * length), count * length)
        length *= GROWTH


def _proof_time(plan: Plan, clock: Clock) -> float:
    """Return the time of the proofs of a member, on average, s, from some of the selected members.

    The proofs of rest states that members share are not counted.
    """
    if plan.prove is None:
        return 0.0
    from rbstab.sweep.proofs.motions import motion_columns

    share = plan.prove.count(plan.members) / plan.members
    if share > 0.5 and all(shares_proof(plan, variant) for variant in plan.variants):
        first = max(0, (plan.members - JOINT_MEMBERS) // 2)
        blocks = [(first, min(first + JOINT_MEMBERS, plan.members))]
    else:
        members = plan.prove.first(PROVED_MEMBERS, plan.members)
        blocks = [(member, member + 1) for member in members]
    start, _ = blocks[0]
    motion_columns(plan, start, start + 1)  # warm-up: the proof of the rest states
    begin, proved = clock(), 0
    for start, stop in blocks:
        motion_columns(plan, start, stop)
        proved += int(plan.prove.selected(start, stop, plan.members).sum())
        if clock() - begin > CALIBRATION_TIME:
            break
    return share * (clock() - begin) / max(proved, 1)


def _comparison_time(plan: Plan, members: list[int], processes: int, clock: Clock) -> float:
    """Return the time of the comparison with SciPy, s, from one member of each variant."""
    if plan.engine == ENGINE:
        return 0.0
    single, seconds = SingleRuns(plan, ENGINE), 0.0
    for compared in _by_variant(plan, members).values():
        seconds += len(compared) * _time(single, compared[0], 1, clock)
    return seconds / min(processes, len(members) or 1)


def _time(engine: MemberEngine, start: int, count: int, clock: Clock) -> float:
    begin, stop = clock(), start + count
    for first in range(start, stop, BATCH_SIZE):
        engine.compute(first, min(first + BATCH_SIZE, stop))
    return clock() - begin
