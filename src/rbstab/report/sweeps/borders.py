"""Members that are worth a look by themselves: those beside a border between outcomes, and such."""

from collections.abc import Iterator

import numpy as np
from scipy.spatial import cKDTree

from rbstab.mechanics.numbers import Array
from rbstab.report.sweeps.members import ENDS, SETTLED, Members

MAX_SEARCHED = 20_000
"""Members among which neighbours are looked for where they were drawn."""

NEIGHBOURS = 8
"""Of each of these."""

PAIRS = 3
"""Pairs across a border that are listed."""

FEW = 2
"""Members of any other kind that are listed."""

FAR = 10.0
"""Between members of different words, along a parameter that is cut to 0 to 1."""


def notable(members: Members) -> list[tuple[str, int]]:
    """Why a member is listed, and its number; each member once, at most about a dozen."""
    found: dict[int, str] = {}
    for why, number in _candidates(members):
        found.setdefault(number, why)
    return [(why, number) for number, why in found.items()]


def _candidates(members: Members) -> Iterator[tuple[str, int]]:
    for a, b in border_pairs(members):
        yield f"beside {b}, which is {ENDS[members.ends[b]]}", a
        yield f"beside {a}, which is {ENDS[members.ends[a]]}", b
    regularity = members.column("smallest_regularity")
    for number in _smallest(np.where(members.completed, regularity, np.nan)):
        yield "smallest cos θ2 of those that stay in the range", number
    if members.level is not None:
        with np.errstate(all="ignore"):
            distance = np.abs(members.column("lyapunov_start") / members.level - 1)
        for number in _smallest(distance):
            yield "v(0) nearest c*", number
    settling = np.where(
        members.ends == ENDS.index(SETTLED), members.column("settling_time"), np.nan
    )
    for number in _smallest(-settling)[:1]:
        yield "settles last", number
    # What is neither a completed motion nor one that left the range failed.
    for number in np.flatnonzero(members.column("status") > 1)[:FEW].tolist():
        yield ENDS[members.ends[number]], number


def border_pairs(members: Members) -> list[tuple[int, int]]:
    """Pairs of neighbours that ended in different ways, the nearest first.

    In a grid neighbours differ by one entry of one axis; the pairs are then taken from all over the
    border. Of members that were drawn the nearest ones are found, as their parameters are scaled
    to lengths of 1.
    """
    plan = members.plan
    if plan is None or np.count_nonzero(members.counts) < 2 or not members.parameters:
        return []
    found = _in_grid(members) if plan.design is None else _among_drawn(members)
    return found[:PAIRS]


def _in_grid(members: Members) -> list[tuple[int, int]]:
    assert members.plan is not None
    shape = tuple(members.plan.dimensions.values())
    ends = members.ends.reshape(shape)
    numbers = np.arange(len(members)).reshape(shape)
    pairs = []
    for axis, (name, length) in enumerate(members.plan.dimensions.items()):
        if length < 2 or any(p.name == name and p.axis.words for p in members.parameters):
            continue
        one, next_one = (
            np.take(numbers, np.arange(*ends_of), axis=axis)
            for ends_of in ((0, length - 1), (1, length))
        )
        differs = np.take(ends, np.arange(length - 1), axis=axis) != np.take(
            ends, np.arange(1, length), axis=axis
        )
        pairs.append(np.stack([one[differs], next_one[differs]], axis=1))
    found = np.concatenate(pairs) if pairs else np.zeros((0, 2), int)
    if not len(found):
        return []
    picked = np.unique(((np.arange(PAIRS) + 0.5) * len(found) / PAIRS).astype(int))
    return [(int(a), int(b)) for a, b in found[picked].tolist()]


def _among_drawn(members: Members) -> list[tuple[int, int]]:
    chosen = _searched(members)
    points = np.stack(
        [
            (p.values * FAR if p.axis.words else p.unit_values)[chosen].astype(float)
            for p in members.parameters
        ],
        axis=1,
    )
    ends = members.ends[chosen]
    wanted = min(NEIGHBOURS + 1, len(chosen))
    distances, near = cKDTree(points).query(points, k=wanted)
    near = near.reshape(len(chosen), wanted)
    own = np.broadcast_to(np.arange(len(chosen))[:, np.newaxis], near.shape)
    across = (ends[own] != ends[near]) & (distances.reshape(near.shape) < FAR / 2)
    order = np.argsort(distances.reshape(near.shape)[across], kind="stable")
    pairs = np.sort(np.stack([own[across], near[across]], axis=1)[order], axis=1)
    unique = dict.fromkeys(map(tuple, pairs[: 20 * PAIRS].tolist()))
    return [(int(chosen[a]), int(chosen[b])) for a, b in unique]


def _searched(members: Members) -> Array:
    """The numbers of the members that are searched: the first points of each group."""
    assert members.plan is not None
    assert members.plan.design is not None
    points = members.plan.design.points
    groups = len(members) // points
    first = np.arange(min(points, max(1, MAX_SEARCHED // groups)))
    found: Array = (np.arange(groups)[:, np.newaxis] * points + first).ravel()
    return found[:MAX_SEARCHED]


def _smallest(values: Array) -> list[int]:
    finite = np.flatnonzero(np.isfinite(values))
    found: list[int] = finite[np.argsort(values[finite], kind="stable")[:FEW]].tolist()
    return found
