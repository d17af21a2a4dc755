"""Select notable members: extremes, failures, and members next to a border between outcomes."""

from collections.abc import Iterator

import numpy as np
from scipy.spatial import cKDTree

from rbstab.mechanics.numbers import Array
from rbstab.report.sweeps.members import FAILED, OUTCOMES, Members

MAX_SEARCHED = 10_000
"""Maximum number of sampled members among which neighbours are searched."""

NEIGHBOURS = 8
"""Number of nearest neighbours to search for each member."""

MAX_PAIRS = 3
"""Maximum number of pairs across a border in the list."""

MAX_PER_REASON = 2
"""Maximum number of members in the list for each other reason."""

CATEGORY_DISTANCE = 10.0
"""Distance between members with different categories; numbers are scaled to 0 to 1."""


def notable(members: Members) -> list[tuple[str, int]]:
    """Return the reason and the number of each notable member, without duplicates.

    There are about a dozen at most.
    """
    reasons: dict[int, str] = {}
    for reason, number in _candidates(members):
        reasons.setdefault(number, reason)
    return [(reason, number) for number, reason in reasons.items()]


def _candidates(members: Members) -> Iterator[tuple[str, int]]:
    for a, b in border_pairs(members):
        yield f"next to member {b} ({OUTCOMES[members.outcomes[b]]})", a
        yield f"next to member {a} ({OUTCOMES[members.outcomes[a]]})", b
    regularity = members.column("smallest_regularity")
    for number in _smallest(np.where(members.completed, regularity, np.nan)):
        yield "smallest cos θ2 of completed members", number
    if members.level is not None:
        with np.errstate(all="ignore"):
            distance = np.abs(members.column("lyapunov_start") / members.level - 1)
        for number in _smallest(distance):
            yield "v(0) nearest c*", number
    settling = np.where(members.at_rest, members.column("settling_time"), np.nan)
    for number in _smallest(-settling)[:1]:
        yield "comes to rest last", number
    for number in np.flatnonzero(members.outcomes == FAILED)[:MAX_PER_REASON].tolist():
        yield OUTCOMES[members.outcomes[number]], number


def border_pairs(members: Members) -> list[tuple[int, int]]:
    """Return pairs of neighbours with different outcomes.

    In a grid, neighbours differ by one entry of one axis; the pairs are spread over the border.
    For sampled members the closest pairs are returned, the closest first; distances are between
    parameters scaled to 0 to 1.
    """
    plan = members.plan
    if plan is None or np.count_nonzero(members.outcome_counts) < 2 or not members.parameters:
        return []
    pairs = _in_grid(members) if plan.design is None else _among_sampled(members)
    return pairs[:MAX_PAIRS]


def _in_grid(members: Members) -> list[tuple[int, int]]:
    assert members.plan is not None
    shape = tuple(members.plan.dimensions.values())
    outcomes = members.outcomes.reshape(shape)
    numbers = np.arange(len(members)).reshape(shape)
    pairs = []
    for axis, (name, length) in enumerate(members.plan.dimensions.items()):
        if length < 2 or any(p.name == name and p.axis.categories for p in members.parameters):
            continue
        lower, upper = (
            np.take(numbers, np.arange(*bounds), axis=axis)
            for bounds in ((0, length - 1), (1, length))
        )
        differs = np.take(outcomes, np.arange(length - 1), axis=axis) != np.take(
            outcomes, np.arange(1, length), axis=axis
        )
        pairs.append(np.stack([lower[differs], upper[differs]], axis=1))
    border = np.concatenate(pairs) if pairs else np.zeros((0, 2), int)
    if not len(border):
        return []
    picked = np.unique(((np.arange(MAX_PAIRS) + 0.5) * len(border) / MAX_PAIRS).astype(int))
    return [(int(a), int(b)) for a, b in border[picked].tolist()]


def _among_sampled(members: Members) -> list[tuple[int, int]]:
    searched = _searched(members)
    points = np.stack(
        [
            (p.values * CATEGORY_DISTANCE if p.axis.categories else p.unit_values)[searched].astype(
                float
            )
            for p in members.parameters
        ],
        axis=1,
    )
    outcomes = members.outcomes[searched]
    count = min(NEIGHBOURS + 1, len(searched))
    distances, near = cKDTree(points).query(points, k=count)
    near = near.reshape(len(searched), count)
    own = np.broadcast_to(np.arange(len(searched))[:, np.newaxis], near.shape)
    across = (outcomes[own] != outcomes[near]) & (
        distances.reshape(near.shape) < CATEGORY_DISTANCE / 2
    )
    order = np.argsort(distances.reshape(near.shape)[across], kind="stable")
    pairs = np.sort(np.stack([own[across], near[across]], axis=1)[order], axis=1)
    unique = dict.fromkeys(map(tuple, pairs[: 20 * MAX_PAIRS].tolist()))
    return [(int(searched[a]), int(searched[b])) for a, b in unique]


def _searched(members: Members) -> Array:
    """Return the numbers of the members to search: those of the first points of each condition."""
    assert members.plan is not None
    assert members.plan.design is not None
    points = members.plan.design.points
    groups = len(members) // points
    first = np.arange(min(points, max(1, MAX_SEARCHED // groups)))
    numbers: Array = (np.arange(groups)[:, np.newaxis] * points + first).ravel()
    return numbers[:MAX_SEARCHED]


def _smallest(values: Array) -> list[int]:
    finite = np.flatnonzero(np.isfinite(values))
    if len(finite) > MAX_PER_REASON:
        limit = np.partition(values[finite], MAX_PER_REASON - 1)[MAX_PER_REASON - 1]
        finite = finite[values[finite] <= limit]
    smallest: list[int] = finite[
        np.argsort(values[finite], kind="stable")[:MAX_PER_REASON]
    ].tolist()
    return smallest
