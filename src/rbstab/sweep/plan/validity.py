"""Whether every member of a plan is a config that can be run, found without making them all.

Every bound of the schema on a number is an interval, so a column is right where its least and its
greatest value are. If both ends of its distribution are, that is known at once; if not, the members
are searched for the values that they really have. The entries of a full matrix make sense together
only (it must be symmetric and positive definite), so those that vary are tried for all members.
"""

from collections.abc import Iterator
from dataclasses import replace
from operator import itemgetter
from typing import Any

import numpy as np

from rbstab.config.errors import ConfigError, Problem
from rbstab.config.load import load_config
from rbstab.config.quantities import ROUND_OFF
from rbstab.config.source import Path, Source, key_of
from rbstab.mechanics.numbers import Array
from rbstab.sweep.plan.axes import VARIANT, Column, at
from rbstab.sweep.plan.plan import Plan

BLOCK = 1 << 16
"""Members that are looked at together."""

VARIANT_KEY = key_of(VARIANT)


def problems_of_members(plan: Plan, source: Source) -> list[Problem]:
    """One problem for each column (or matrix) that makes members wrong, naming one such member.

    Args:
        plan: A plan whose bases are right and have its keys.
        source: Where it was read from.
    """
    problems: list[Problem] = []
    for variant in plan.variants:
        columns = plan.columns_of(variant)
        single = [column for column in columns if not _in_matrix(column)]
        problems += _problems_of_columns(plan, source, variant, single)
        matrices: dict[Path, list[Column]] = {}
        for column in columns:
            if _in_matrix(column):
                matrices.setdefault(column.path[:-2], []).append(column)
        for path, entries in matrices.items():
            problems += _problems_of_matrix(plan, source, variant, path, entries)
    # The first variant tells what is wrong for several.
    return list({(p.location, p.key): p for p in reversed(problems)}.values())


def _in_matrix(column: Column) -> bool:
    return all(isinstance(part, int) for part in column.path[-2:])


def _problems_of_columns(
    plan: Plan, source: Source, variant: str, columns: list[Column]
) -> list[Problem]:
    doubtful = {
        column.key: column
        for column in columns
        if any(_wrong(plan, variant, {column.key: end}) for end in column.distribution.ends)
    }
    problems = []
    for key, extremes in _extremes(plan, variant, list(doubtful)).items():
        for number, value in extremes:
            wrong = _wrong(plan, variant, {key: value})
            if wrong:
                problems.append(_told(source, doubtful[key], number, wrong[0]))
                break
    return problems


def _problems_of_matrix(
    plan: Plan, source: Source, variant: str, path: Path, entries: list[Column]
) -> list[Problem]:
    base = np.array(at(plan.templates[variant], path))
    keys = [column.key for column in entries]
    for numbers, values in _blocks(plan, variant, keys):
        matrices = np.tile(base, (len(numbers), 1, 1))
        for column in entries:
            row, entry = (int(part) for part in column.path[-2:])
            factor = base[row, entry] if column.scale else 1.0
            with np.errstate(over="ignore"):
                matrices[:, row, entry] = values[column.key] * factor
        # Where this is stricter than the schema, by round-off, the schema decides.
        for index in np.flatnonzero(~_positive_definite(matrices)):
            chosen = {key: float(values[key][index]) for key in keys}
            wrong = _wrong(plan, variant, chosen)
            if wrong:
                return [_told(source, entries[0], int(numbers[index]), wrong[0])]
    return []


def _positive_definite(matrices: Array) -> Array:
    """Which of some matrices are finite, symmetric, and positive definite beyond round-off."""
    symmetric = (matrices == matrices.transpose(0, 2, 1)).all(axis=(1, 2))
    finite = np.isfinite(matrices).all(axis=(1, 2), keepdims=True)
    tried = np.where(finite, matrices, 0.0)
    smallest = np.linalg.eigvalsh(tried)[:, 0]
    return symmetric & (smallest > 4 * ROUND_OFF * np.abs(tried).max(axis=(1, 2)))


def _extremes(plan: Plan, variant: str, keys: list[str]) -> dict[str, list[tuple[int, float]]]:
    """The members of a variant with the least and the greatest value of some columns."""
    found: dict[str, list[tuple[int, float]]] = {}
    if not keys:
        return found
    for numbers, values in _blocks(plan, variant, keys):
        for key, column in values.items():
            ends = [int(np.argmin(column)), int(np.argmax(column))]
            members = [(int(numbers[index]), float(column[index])) for index in ends]
            members = [*found.get(key, []), *members]
            # Of equal values the earliest member is kept.
            found[key] = [min(members, key=itemgetter(1)), max(members, key=itemgetter(1))]
    return found


def _blocks(plan: Plan, variant: str, keys: list[str]) -> Iterator[tuple[Array, dict[str, Array]]]:
    """The numbers of the members of a variant, and their values at some keys, block by block."""
    varies = any(column.path == VARIANT for column in plan.columns)
    for start in range(0, plan.members, BLOCK):
        stop = min(start + BLOCK, plan.members)
        numbers = np.arange(start, stop)
        if varies:
            numbers = numbers[plan.values(start, stop, [VARIANT_KEY])[VARIANT_KEY] == variant]
        if len(numbers):
            values = plan.values(start, stop, keys)
            yield numbers, {key: column[numbers - start] for key, column in values.items()}


def _wrong(plan: Plan, variant: str, values: dict[str, Any]) -> tuple[Problem, ...]:
    """What is wrong with the base of a variant when some columns have given values."""
    try:
        load_config(plan.data_of(variant, values))
    except ConfigError as error:
        return error.problems
    return ()


def _told(source: Source, column: Column, number: int, problem: Problem) -> Problem:
    """A problem of a member at the place in the plan that it comes from."""
    return replace(
        problem,
        location=source.location(column.place, of_key=True),
        key=key_of(column.place),
        problem=f"at member {number} {problem.key} {problem.problem}",
    )
