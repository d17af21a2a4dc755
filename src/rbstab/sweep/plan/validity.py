"""Check that every member of a plan is a valid config, without making all configs.

The schema bounds every number by an interval. So a varied key is valid if its smallest and its
largest value are valid. If both bounds of its distribution are valid, nothing else is computed. If
not, the members are searched for their smallest and largest values.

The entries of a full matrix are valid only together: the matrix must be symmetric and positive
definite. So matrices with varied entries are checked for all members.
"""

from collections.abc import Iterator
from dataclasses import replace
from operator import itemgetter
from typing import Any

import numpy as np

from rbstab.config.errors import ConfigError, ConfigProblem
from rbstab.config.load import changed_config
from rbstab.config.numbers import value_at
from rbstab.config.quantities import ROUND_OFF
from rbstab.config.source import Path, Source, key_of
from rbstab.mechanics.numbers import Array
from rbstab.sweep.plan.axes import VARIANT, VariedKey
from rbstab.sweep.plan.plan import Plan

BLOCK_SIZE = 1 << 16
"""Members that are checked together."""

VARIANT_KEY = key_of(VARIANT)


def problems_of_members(plan: Plan, source: Source) -> list[ConfigProblem]:
    """Return one problem for each varied key (or matrix) that makes members invalid.

    Each problem names one such member.

    Args:
        plan: A plan with valid bases; each varied key is in at least one base.
        source: The source of the plan.
    """
    problems: list[ConfigProblem] = []
    for variant in plan.variants:
        varied_keys = plan.varied_keys_of(variant)
        single = [varied for varied in varied_keys if not _in_matrix(varied)]
        problems += _problems_of_keys(plan, source, variant, single)
        matrices: dict[Path, list[VariedKey]] = {}
        for varied in varied_keys:
            if _in_matrix(varied):
                matrices.setdefault(varied.path[:-2], []).append(varied)
        for path, entries in matrices.items():
            problems += _problems_of_matrix(plan, source, variant, path, entries)
    # If several variants have the same problem, keep the problem of the first variant.
    return list({(p.location, p.key): p for p in reversed(problems)}.values())


def _in_matrix(varied: VariedKey) -> bool:
    return all(isinstance(part, int) for part in varied.path[-2:])


def _problems_of_keys(
    plan: Plan, source: Source, variant: str, varied_keys: list[VariedKey]
) -> list[ConfigProblem]:
    doubtful = {
        varied.key: varied
        for varied in varied_keys
        if any(
            _problems_with(plan, variant, {varied.key: bound})
            for bound in varied.distribution.bounds
        )
    }
    problems = []
    for key, extremes in _extremes(plan, variant, list(doubtful)).items():
        for number, value in extremes:
            found = _problems_with(plan, variant, {key: value})
            if found:
                problems.append(_in_plan(source, doubtful[key], number, found[0]))
                break
    return problems


def _problems_of_matrix(
    plan: Plan, source: Source, variant: str, path: Path, entries: list[VariedKey]
) -> list[ConfigProblem]:
    base = np.array(value_at(plan.templates[variant], path))
    keys = [varied.key for varied in entries]
    for numbers, values in _blocks(plan, variant, keys):
        matrices = np.tile(base, (len(numbers), 1, 1))
        for varied in entries:
            row, entry = (int(part) for part in varied.path[-2:])
            factor = varied.factor(base[row, entry])
            with np.errstate(over="ignore"):
                matrices[:, row, entry] = values[varied.key] * factor
        # The test is stricter than the schema, by the round-off. The schema decides.
        for index in np.flatnonzero(~_positive_definite(matrices)):
            chosen = {key: float(values[key][index]) for key in keys}
            found = _problems_with(plan, variant, chosen)
            if found:
                return [_in_plan(source, entries[0], int(numbers[index]), found[0])]
    return []


def _positive_definite(matrices: Array) -> Array:
    """Return whether each matrix is finite, symmetric, and positive definite beyond round-off.

    Args:
        matrices: Shape (m, n, n).

    Returns:
        Shape (m,).
    """
    symmetric = (matrices == matrices.transpose(0, 2, 1)).all(axis=(1, 2))
    finite = np.isfinite(matrices).all(axis=(1, 2), keepdims=True)
    tried = np.where(finite, matrices, 0.0)
    smallest = np.linalg.eigvalsh(tried)[:, 0]
    return symmetric & (smallest > 4 * ROUND_OFF * np.abs(tried).max(axis=(1, 2)))


def _extremes(plan: Plan, variant: str, keys: list[str]) -> dict[str, list[tuple[int, float]]]:
    """Return, for each key, the members of a variant with the smallest and the largest value."""
    found: dict[str, list[tuple[int, float]]] = {}
    if not keys:
        return found
    for numbers, values in _blocks(plan, variant, keys):
        for key, entries in values.items():
            extremes = [int(np.argmin(entries)), int(np.argmax(entries))]
            members = [(int(numbers[index]), float(entries[index])) for index in extremes]
            members = [*found.get(key, []), *members]
            # Among members with equal values, keep the earliest.
            found[key] = [min(members, key=itemgetter(1)), max(members, key=itemgetter(1))]
    return found


def _blocks(plan: Plan, variant: str, keys: list[str]) -> Iterator[tuple[Array, dict[str, Array]]]:
    """Yield blocks of members of a variant: their numbers, and their values of some keys."""
    varies = any(varied.path == VARIANT for varied in plan.varied_keys)
    for start in range(0, plan.members, BLOCK_SIZE):
        stop = min(start + BLOCK_SIZE, plan.members)
        numbers = np.arange(start, stop)
        if varies:
            numbers = numbers[plan.values(start, stop, [VARIANT_KEY])[VARIANT_KEY] == variant]
        if len(numbers):
            values = plan.values(start, stop, keys)
            yield numbers, {key: entries[numbers - start] for key, entries in values.items()}


def _problems_with(plan: Plan, variant: str, values: dict[str, Any]) -> tuple[ConfigProblem, ...]:
    """Return the problems of the base of a variant with these values of some varied keys."""
    try:
        changed_config(plan.bases[variant], plan.data_of(variant, values))
    except ConfigError as error:
        return error.problems
    return ()


def _in_plan(
    source: Source, varied: VariedKey, number: int, problem: ConfigProblem
) -> ConfigProblem:
    """Return a problem of a member, located at its varied key in the plan."""
    return replace(
        problem,
        location=source.location(varied.place, of_key=True),
        key=key_of(varied.place),
        problem=f"at member {number} {problem.key} {problem.problem}",
    )
