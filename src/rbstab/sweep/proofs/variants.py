"""The members of each variant of a plan, with their values."""

from collections.abc import Collection, Iterable, Iterator

import numpy as np

from rbstab.config.source import key_of
from rbstab.mechanics.numbers import Array
from rbstab.sweep.plan.axes import VARIANT
from rbstab.sweep.plan.plan import Plan

VARIANT_KEY = key_of(VARIANT)

Rows = tuple[str, Array, dict[str, Array]]
"""A variant, its rows among some members, and the values of their varied keys."""


def rows_of_variants(
    plan: Plan, variants: Iterable[str], start: int, stop: int, keys: Collection[str] | None = None
) -> Iterator[Rows]:
    """Yield the members of some variants from number `start` up to `stop`.

    Args:
        plan: The plan.
        variants: The variants; without one, no value is computed.
        start: The first member.
        stop: One after the last member, as in `range`.
        keys: The wanted keys; default all varied keys.
    """
    chosen = list(variants)
    if not chosen:
        return
    values = plan.values(start, stop, None if keys is None else [*keys, VARIANT_KEY])
    named = values.get(VARIANT_KEY)
    for variant in chosen:
        if named is None:
            yield variant, np.arange(stop - start), values
            continue
        rows = np.flatnonzero(named == variant)
        yield variant, rows, {key: entries[rows] for key, entries in values.items()}
