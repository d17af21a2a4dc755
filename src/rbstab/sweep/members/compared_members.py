"""Select the members to compare with single runs by SciPy: the plan alone decides which."""

from itertools import product
from math import prod

import numpy as np

from rbstab.config.source import key_of
from rbstab.mechanics.numbers import Array
from rbstab.sweep.plan.axes import VARIANT
from rbstab.sweep.plan.plan import Plan

MIN_COMPARED, MAX_COMPARED = 4, 16
"""The number of compared members, unless a number is given."""

MEMBERS_PER_COMPARED = 10_000
"""Between these limits, one member of this many is compared."""

MAX_CANDIDATES = 4096
"""Members among which the extremes are looked for, if the plan has more."""

BLOCK = 64
"""Consecutive members among the candidates: their values are computed together."""

MAX_CORNER_AXES = 6
"""Axes of a grid whose ends are combined; of further axes only the first entry is used."""

MAX_SPREAD = 64
"""At most this many members of a variant are selected by their values, the others evenly."""


def is_comparable(variant: str) -> bool:
    """Return whether two engines find the same trajectories: not if the motion may be chaotic."""
    return variant != "sliding"


def members_to_compare(plan: Plan, count: int | None = None) -> list[int]:
    """Return the members to compare, ascending: of each comparable variant the same number.

    The first member of a variant is the one in the middle of the varied values. Each further one is
    as far as possible from those before, so the extremes come first. Sliding members are left out.

    Args:
        plan: The plan.
        count: How many; default one of `MEMBERS_PER_COMPARED`, from `MIN_COMPARED` to
            `MAX_COMPARED`. At least one of each comparable variant is compared.
    """
    if count is None:
        count = plan.members // MEMBERS_PER_COMPARED
        count = min(max(count, MIN_COMPARED), MAX_COMPARED)
    candidates = _candidates(plan)
    values = _values(plan, candidates)
    names = values.pop(key_of(VARIANT), None)
    variants = [variant for variant in plan.variants if is_comparable(variant)]
    found: list[int] = []
    for number, variant in enumerate(variants):
        share = max(1, count // len(variants) + (number < count % len(variants)))
        rows = np.arange(len(candidates)) if names is None else np.flatnonzero(names == variant)
        keys = {varied.key for varied in plan.varied_keys_of(variant)}
        ranks = [_ranks(column[rows]) for key, column in values.items() if key in keys]
        points = np.array(ranks).T if ranks else np.zeros((len(rows), 0))
        spread = rows[_spread(points, min(share, MAX_SPREAD))]
        found += candidates[spread].tolist()
        rest = np.setdiff1d(rows, spread)
        even = np.linspace(0, len(rest) - 1, min(share - len(spread), len(rest)))
        found += candidates[rest[even.astype(int)]].tolist()
    return sorted(found)


def _candidates(plan: Plan) -> Array:
    """Return members that cover the plan, ascending: the corners of its grid, and even blocks."""
    if plan.members <= MAX_CANDIDATES:
        return np.arange(plan.members)
    starts = np.linspace(0, plan.members - BLOCK, MAX_CANDIDATES // BLOCK).astype(int)
    blocks = (starts[:, np.newaxis] + np.arange(BLOCK)).ravel()
    return np.unique(np.concatenate([blocks, _corners(plan)]))


def _corners(plan: Plan) -> Array:
    """Return the members at the ends of the axes of the grid, for every variant.

    A longer axis with the variant counts as any other: the even blocks contain all its variants.
    """
    lengths = plan.dimensions
    with_variant = {a.name for a in plan.axes for k in a.varied_keys if k.path == VARIANT}
    entries, left = [], MAX_CORNER_AXES
    for name, length in lengths.items():
        if name in with_variant and length <= BLOCK:
            entries.append(tuple(range(length)))
        else:
            entries.append((0, length - 1) if left > 0 else (0,))
            left -= 1
    sizes = list(lengths.values())
    strides = [prod(sizes[k + 1 :]) for k in range(len(sizes))]
    corners = [
        sum(index * stride for index, stride in zip(corner, strides, strict=True))
        for corner in product(*entries)
    ]
    return np.array(corners, dtype=int)


def _values(plan: Plan, members: Array) -> dict[str, Array]:
    """Return the values of some members, ascending; consecutive ones are computed together."""
    runs = np.split(members, np.flatnonzero(np.diff(members) != 1) + 1)
    parts = [plan.values(int(run[0]), int(run[-1]) + 1) for run in runs]
    return {key: np.concatenate([part[key] for part in parts]) for key in parts[0]}


def _ranks(values: Array) -> Array:
    """Return the ranks of values, from 0 for the smallest to 1 for the largest."""
    distinct, ranks = np.unique(values, return_inverse=True)
    return np.asarray(ranks / max(len(distinct) - 1, 1))


def _spread(points: Array, count: int) -> list[int]:
    """Return the point nearest to the middle, then points as far as possible from those before.

    Args:
        points: Shape (m, keys), from 0 to 1.
        count: The largest number of points.
    """
    if not len(points):
        return []
    chosen = [int(np.abs(points - 0.5).sum(axis=1).argmin())]
    distance = np.full(len(points), np.inf)
    while len(chosen) < min(count, len(points)):
        distance = np.minimum(distance, ((points - points[chosen[-1]]) ** 2).sum(axis=1))
        distance[chosen] = -1.0
        chosen.append(int(distance.argmax()))
    return chosen
