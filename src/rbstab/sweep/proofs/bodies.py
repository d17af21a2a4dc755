"""The distinct bodies of a plan: members that differ only in their initial state share a proof."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from rbstab.config.entries import is_of_initial_state
from rbstab.config.source import key_of
from rbstab.mechanics.numbers import Array
from rbstab.sweep.plan.axes import VARIANT, VariedKey
from rbstab.sweep.plan.plan import Plan
from rbstab.sweep.proofs.convergence import undecided_reason
from rbstab.sweep.proofs.spread_order import alternated, spread_order

VARIANT_KEY = key_of(VARIANT)

MAX_NAMED = 6
"""The largest number of ranges of members that a sentence lists."""


@dataclass(frozen=True, eq=False)
class Bodies:
    """The distinct bodies of a plan, each with its gravity, gains and elements.

    They are numbered from 0 in the order of their first members.

    Attributes:
        of_member: The number of each member's body, shape (members,); -1 if no theorem decides the
            motions of its variant.
        first: The first member of each body, ascending, shape (bodies,).
        order: The bodies in an order of which every beginning is spread over the values of all
            varied keys, and over the variants, shape (bodies,).
    """

    of_member: Array
    first: Array
    order: Array

    def __len__(self) -> int:
        return len(self.first)

    def members(self, body: int) -> Array:
        """Return the numbers of the members that have a body, ascending."""
        return np.flatnonzero(self.of_member == body)


def bodies_of(plan: Plan) -> Bodies:
    """Return the distinct bodies of a plan."""
    names = {variant: own_keys(plan, variant) for variant in plan.variants}
    keys = {varied.key for own in names.values() for varied in own}
    values = plan.values(0, plan.members, [*keys, VARIANT_KEY])
    variants = values.get(VARIANT_KEY)
    of_member = np.full(plan.members, -1)
    firsts: list[Array] = []
    orders: list[Array] = []
    for variant, own in names.items():
        if undecided_reason(plan, variant) is not None:
            continue
        rows = np.arange(plan.members) if variants is None else np.flatnonzero(variants == variant)
        # One more row of zeros: a body of its own if nothing of it varies.
        numbers = [np.zeros(len(rows)), *(values[one.key][rows].astype(float) for one in own)]
        table = np.stack(numbers, axis=1)
        distinct, first, inverse = np.unique(table, axis=0, return_index=True, return_inverse=True)
        of_member[rows] = sum(map(len, firsts)) + inverse.ravel()
        orders.append(sum(map(len, firsts)) + spread_order(distinct))
        firsts.append(rows[first])
    found = np.concatenate([np.zeros(0, dtype=int), *firsts])
    order = np.argsort(found)
    place = np.append(np.argsort(order), -1)  # the last entry stays -1
    return Bodies(place[of_member], found[order], place[alternated(orders)])


def own_keys(plan: Plan, variant: str) -> tuple[VariedKey, ...]:
    """Return the varied keys of a variant that are not of the initial state."""
    keys = plan.varied_keys_of(variant)
    return tuple(varied for varied in keys if not is_of_initial_state(varied.path))


def ranges_of(numbers: Iterable[int]) -> list[tuple[int, int]]:
    """Return ascending numbers as ranges: the first and the last number of each."""
    found: list[tuple[int, int]] = []
    for number in numbers:
        if found and number == found[-1][1] + 1:
            found[-1] = (found[-1][0], number)
        else:
            found.append((number, number))
    return found


def named_members(ranges: Sequence[tuple[int, int]]) -> str:
    """Return ranges of members as words: `members 3 to 7, 9`; many are cut."""
    names = [str(first) if first == last else f"{first} to {last}" for first, last in ranges]
    left = sum(last - first + 1 for first, last in ranges[MAX_NAMED:])
    more = f" and {left} more" if left else ""
    return f"members {', '.join(names[:MAX_NAMED])}{more}"
