"""The variants of a plan: their members with their values, and what a theorem says of them."""

from collections.abc import Collection, Iterable, Iterator

import numpy as np

from rbstab.config.numbers import is_of_initial_state
from rbstab.config.source import key_of
from rbstab.config.user_code.permission import has_code, may_run_code
from rbstab.experiment.convergence.decisions import nothing_proved
from rbstab.experiment.proof import CODE_NOT_RUN
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


def members_of_variants(plan: Plan, variants: Iterable[str]) -> Array:
    """Return which members have one of some variants, shape (members,)."""
    has_variant = np.zeros(plan.members, bool)
    for _, rows, _ in rows_of_variants(plan, variants, 0, plan.members, ()):
        has_variant[rows] = True
    return has_variant


def shares_proof(plan: Plan, variant: str) -> bool:
    """Return whether one proof of rest states says something about all members of a variant."""
    return undecided_reason(plan, variant) is None and all(
        is_of_initial_state(varied.path) for varied in plan.varied_keys_of(variant)
    )


def undecided_reason(plan: Plan, variant: str) -> str | None:
    """Return why no theorem decides the motions of a variant, or None if one may.

    The reason is what acts on the body.
    """
    base = plan.base_of(variant)
    if has_code(base) and not may_run_code(base):
        # It may be a stored plan, whose code must not run.
        return CODE_NOT_RUN
    undecided = nothing_proved(plan.initial_value_problems[variant])
    return None if undecided is None else undecided.why


def without_theorem(plan: Plan) -> dict[str, Array]:
    """Return the members that no theorem covers: a mask of shape (members,) by the reason.

    Code of a user that may not run here is no such reason: the sweep that made the proofs ran it.
    """
    reasons = {variant: undecided_reason(plan, variant) for variant in plan.variants}
    return {
        reason: members_of_variants(plan, [v for v, why in reasons.items() if why == reason])
        for reason in dict.fromkeys(reasons.values())
        if reason not in (None, CODE_NOT_RUN)
    }
