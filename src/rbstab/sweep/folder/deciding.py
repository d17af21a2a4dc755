"""The sentence that names the parameter of a sweep that decides which members return."""

from contextlib import suppress

import numpy as np

from rbstab.experiment.answers.outcome import KINDS, OutcomeKind
from rbstab.experiment.answers.threshold import (
    NamedNumber,
    Threshold,
    alike,
    by_chance,
    distinct,
    named_number,
    short_key,
    threshold_of,
)
from rbstab.files.text import grouped
from rbstab.mechanics.numbers import Array
from rbstab.store.table import Table
from rbstab.store.variables import safe_name
from rbstab.sweep.plan.axes import VARIANT, Axis, VariedKey
from rbstab.sweep.plan.plan import Plan

CHANCE = 0.01
"""Of sampled members, a parameter decides only if chance does so less often than this."""

NOT_RETURNED = (OutcomeKind.RESTS_ELSEWHERE, OutcomeKind.UNSTABLE, OutcomeKind.LEFT_RANGE)
"""The kinds of members that are known not to return. One that still moves may return later."""


def deciding_sentence(plan: Plan, table: Table) -> str:
    """Return from which value of one parameter on members return, without a full stop.

    The parameter decides if its values separate the members that return from those that do not,
    whatever the values of the others. Members that still move are neither.

    Args:
        plan: The plan.
        table: Its table, with the outcomes and the columns of the varied keys.

    Returns:
        The sentence; "" if no parameter decides, or more than one.
    """
    kinds, good = table["outcome"], table["outcome"] == KINDS.index(OutcomeKind.RETURNS)
    bad = np.isin(kinds, [KINDS.index(kind) for kind in NOT_RETURNED])
    axes = [axis for axis in plan.axes if _has_numbers(axis, table)]
    others = int(np.count_nonzero(bad if bad.any() else ~good))
    if plan.design is not None and by_chance(int(good.sum()), others, len(axes)) > CHANCE:
        return ""
    sentences = []
    for axis in axes:
        varied = max(axis.varied_keys, key=lambda k: len(np.unique(table[safe_name(k.key)])))
        number = shown_number(plan, varied, table)
        values = number.value * table[safe_name(varied.key)]
        threshold = threshold_of(values, good, bad)
        if threshold is not None:
            others_of_axis = len(axis.varied_keys) > 1
            name = f"{number.name} (and what varies with it)" if others_of_axis else number.name
            sentences.append(_sentence(threshold, number._replace(name=name), values, table))
    return sentences[0] if len(sentences) == 1 else ""


def _has_numbers(axis: Axis, table: Table) -> bool:
    """Return whether the values of an axis are numbers, and more than one."""
    if axis.counts_members or any(key.path == VARIANT for key in axis.varied_keys):
        return False
    columns = [table[safe_name(key.key)] for key in axis.varied_keys]
    return any(column.min() < column.max() for column in columns)


def shown_number(plan: Plan, varied: VariedKey, table: Table) -> NamedNumber:
    """Return the number of the config that stands for a varied key, with the unit of its values.

    Its value times the column of the key is the number of each member. Where a plan varies factors,
    it is the first number that they scale.

    Args:
        plan: The plan.
        varied: The varied key.
        table: The table of the sweep.
    """
    unit = table.variables[safe_name(varied.key)].unit
    for base in plan.bases.values():
        if varied.scale:
            with suppress(LookupError):
                return named_number(base, varied.path)
    return NamedNumber(short_key(varied.key), unit, 1.0)


def _sentence(threshold: Threshold, number: NamedNumber, values: Array, table: Table) -> str:
    end = end_of(table)
    good = threshold.beyond(threshold.good, values, good=True)
    last_bad = threshold.last_open if threshold.bad is None else threshold.bad
    bad = threshold.beyond(last_bad, values, good=False)
    between = ~good & ~bad
    ends = distinct(values[between])
    ends = [ends[0], ends[-1]] if ends else []
    texts = alike([threshold.good, last_bad, *ends])
    unit = f" {number.unit}" if number.unit not in ("", "1") else ""
    sign = threshold.sign(good=True)
    parts = [f"returns by {end} for {number.name} {sign} {texts[threshold.good]}{unit}"]
    if ends:
        span = " to ".join(dict.fromkeys(texts[value] for value in ends))
        word, others = _kinds(between, table, (OutcomeKind.MOVING, OutcomeKind.FAILED))
        parts.append(f"{word} at {span}{others}")
    kinds = NOT_RETURNED if threshold.bad is not None else (OutcomeKind.MOVING, OutcomeKind.FAILED)
    word, others = _kinds(bad, table, kinds)
    parts.append(f"{word} for {threshold.sign(good=False)} {texts[last_bad]}{others}")
    return "; ".join(parts)


def _kinds(chosen: Array, table: Table, first: tuple[OutcomeKind, ...]) -> tuple[str, str]:
    """Return the most common kind of some members, of those in `first`, and the other kinds."""
    counts = np.bincount(table["outcome"][chosen], minlength=len(KINDS)).tolist()
    by_kind = {kind: count for kind, count in zip(KINDS, counts, strict=True) if count}
    main = max((kind for kind in first if kind in by_kind), key=lambda kind: by_kind[kind])
    word = f"{main.words} at {end_of(table)}" if main is OutcomeKind.MOVING else main.words
    others = [f"{kind.words}: {grouped(n)}" for kind, n in by_kind.items() if kind is not main]
    if not others:
        return word, ""
    share = f"{grouped(by_kind[main])} of {grouped(sum(counts))} members"
    return word, f" ({share}; {', '.join(others)})"


def end_of(table: Table) -> str:
    """Return the time at which the runs of members end that did not end early, as text."""
    ends = distinct(table["end_time"][table["status"] == 0])
    return f"{ends[0]:.4g} s" if len(ends) == 1 else "the end"
