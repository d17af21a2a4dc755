"""The distinct bodies of a plan: members that differ only in their initial state share a proof."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rbstab.config.numbers import is_of_initial_state
from rbstab.files.text import grouped
from rbstab.mechanics.numbers import Array
from rbstab.sweep.plan.axes import VariedKey
from rbstab.sweep.plan.plan import Plan
from rbstab.sweep.plan.proof_selection import ProofSelection
from rbstab.sweep.proofs.variants import rows_of_variants, undecided_reason

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
        order: The bodies in an order of which every beginning is spread over the plan, shape
            (bodies,).
    """

    of_member: Array
    first: Array
    order: Array

    def __len__(self) -> int:
        return len(self.first)

    def members(self, body: int) -> Array:
        """Return the numbers of the members that have a body, ascending."""
        return np.flatnonzero(self.of_member == body)


def bodies_of(plan: Plan, variants: Iterable[str] | None = None) -> Bodies:
    """Return the distinct bodies of a plan, or of the members of some variants."""
    names = plan.variants if variants is None else variants
    decided = [name for name in names if undecided_reason(plan, name) is None]
    return distinct_bodies(plan, {name: body_keys(plan, name) for name in decided})


def distinct_bodies(plan: Plan, body_keys_of: Mapping[str, tuple[VariedKey, ...]]) -> Bodies:
    """Return the bodies of some variants, which differ in the numbers at some keys of each."""
    of_member = np.full(plan.members, -1)
    firsts = [np.zeros(0, dtype=int)]
    for rows, table in _numbers_of_bodies(plan, body_keys_of):
        first, inverse = _distinct_rows(table)
        of_member[rows] = sum(map(len, firsts)) + inverse
        firsts.append(rows[first])
    first_members = np.concatenate(firsts)
    by_member = np.argsort(first_members)
    place = np.append(np.argsort(by_member), -1)  # the last entry stays -1
    order = np.array(ProofSelection().first(len(first_members), len(first_members)), dtype=int)
    return Bodies(place[of_member], first_members[by_member], order)


def _numbers_of_bodies(
    plan: Plan, variant_keys: Mapping[str, tuple[VariedKey, ...]]
) -> Iterator[tuple[Array, Array]]:
    """Yield the members of each variant, and the numbers of their bodies."""
    keys = {varied.key for some in variant_keys.values() for varied in some}
    for variant, rows, values in rows_of_variants(plan, variant_keys, 0, plan.members, keys):
        # One more column of zeros: all members have one body if nothing of it varies.
        varied = (values[varied_key.key].astype(float) for varied_key in variant_keys[variant])
        yield rows, np.stack([np.zeros(len(rows)), *varied], axis=1)


def _distinct_rows(table: Array) -> tuple[Array, Array]:
    """Return the first one of each distinct row of a table, and which of these each row equals."""
    # `numpy.unique` takes several times as long. The distinct rows are in the order of their
    # numbers.
    order = np.lexsort(table.T[::-1])  # stable: of equal rows, the first one comes first
    new = np.any(np.diff(table[order], axis=0, prepend=np.nan), axis=1)
    same = np.empty(len(table), dtype=int)
    same[order] = np.cumsum(new) - 1
    return order[new], same


def body_keys(plan: Plan, variant: str) -> tuple[VariedKey, ...]:
    """Return the varied keys of a variant that are not of the initial state."""
    keys = plan.varied_keys_of(variant)
    return tuple(varied for varied in keys if not is_of_initial_state(varied.path))


def values_at_start(plan: Plan, members: Array) -> tuple[tuple[VariedKey, ...], dict[str, Array]]:
    """Return the varied keys of the initial state of the members of a body, and their values."""
    first, stop = int(members[0]), int(members[-1]) + 1
    row = {
        key: entries_of_first.tolist()[0]
        for key, entries_of_first in plan.values(first, first + 1).items()
    }
    varied = plan.varied_keys_of(plan.variant_of(row))
    keys = tuple(varied_key for varied_key in varied if is_of_initial_state(varied_key.path))
    # The members may be far apart.
    some = plan.values(first, stop, [varied_key.key for varied_key in keys]).items()
    return keys, {key: entries[members - first] for key, entries in some}


def ranges_of(numbers: Iterable[int]) -> list[tuple[int, int]]:
    """Return ascending numbers as ranges: the first and the last number of each."""
    ranges: list[tuple[int, int]] = []
    for number in numbers:
        if ranges and number == ranges[-1][1] + 1:
            ranges[-1] = (ranges[-1][0], number)
        else:
            ranges.append((number, number))
    return ranges


def named_members(ranges: Sequence[tuple[int, int]]) -> str:
    """Return ranges of members as words: `members 3 to 7, 9`; many are cut."""
    names = [str(first) if first == last else f"{first} to {last}" for first, last in ranges]
    left = sum(last - first + 1 for first, last in ranges[MAX_NAMED:])
    more = f" and {grouped(left)} more" if left else ""
    return f"members {', '.join(names[:MAX_NAMED])}{more}"
