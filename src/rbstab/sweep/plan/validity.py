"""Check that every member of a plan is a valid config, without making all configs.

The schema bounds every number by an interval. So a varied key is valid if its smallest and its
largest value are valid. If both bounds of its distribution are valid, nothing else is computed. If
not, the members are searched for their smallest and largest values.

The entries of a full matrix are valid only together: the matrix must be symmetric and positive
definite. So matrices with varied entries are checked for all members.
"""

from collections.abc import Iterable, Iterator
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

Suspect = tuple[int, dict[str, float]]
"""The number of a member that may be invalid, and its values of some keys."""


def problems_of_members(plan: Plan, source: Source) -> list[ConfigProblem]:
    """Return one problem for each varied key (or matrix) that makes members invalid.

    Each problem names one such member. What several variants have in common is told of the first.

    Args:
        plan: A plan with valid bases; each varied key is in at least one base.
        source: The source of the plan.
    """
    problems: dict[VariedKey, ConfigProblem] = {}
    for variant in plan.variants:
        for varied, suspects in _suspects(plan, variant):
            for number, values in suspects:
                wrong = _problem_with(plan, variant, values)
                if wrong is not None:
                    text = f"at member {number} {wrong.key} {wrong.problem}"
                    problem = source.problem(varied.place, text, wrong.expected, of_key=True)
                    problems.setdefault(varied, problem)
                    break
    return list(problems.values())


def _suspects(plan: Plan, variant: str) -> Iterator[tuple[VariedKey, Iterable[Suspect]]]:
    """Yield each key that may be wrong, or the first of a matrix, with members to be tried."""
    matrices: dict[Path, list[VariedKey]] = {}
    doubtful: list[VariedKey] = []
    for varied in plan.varied_keys_of(variant):
        if all(isinstance(part, int) for part in varied.path[-2:]):
            matrices.setdefault(varied.path[:-2], []).append(varied)
        elif any(
            _problem_with(plan, variant, {varied.key: bound})
            for bound in varied.distribution.bounds
        ):
            doubtful.append(varied)
    for varied in doubtful:
        yield varied, _extremes(plan, variant, varied.key)
    for path, entries in matrices.items():
        yield entries[0], _indefinite(plan, variant, path, entries)


def _extremes(plan: Plan, variant: str, key: str) -> list[Suspect]:
    """Return the members of a variant with the smallest and the largest value of a key."""
    extremes: list[tuple[float, int]] = []
    for numbers, values in _blocks(plan, variant, [key]):
        entries = values[key]
        ends = [int(np.argmin(entries)), int(np.argmax(entries))]
        extremes += [(float(entries[index]), int(numbers[index])) for index in ends]
        # Among members with equal values, keep the earliest.
        extremes = [min(extremes), max(extremes, key=lambda pair: (pair[0], -pair[1]))]
    return [(number, {key: value}) for value, number in extremes]


def _indefinite(
    plan: Plan, variant: str, path: Path, entries: list[VariedKey]
) -> Iterator[Suspect]:
    """Yield the members whose matrix is not positive definite beyond round-off."""
    base = np.array(value_at(plan.templates[variant], path))
    keys = [varied.key for varied in entries]
    for numbers, values in _blocks(plan, variant, keys):
        matrices = np.tile(base, (len(numbers), 1, 1))
        for varied in entries:
            row, column = (int(part) for part in varied.path[-2:])
            with np.errstate(over="ignore"):
                factor = varied.factor(base[row, column])
                matrices[:, row, column] = values[varied.key] * factor
        symmetric = (matrices == matrices.transpose(0, 2, 1)).all(axis=(1, 2))
        finite = np.isfinite(matrices).all(axis=(1, 2), keepdims=True)
        tried = np.where(finite, matrices, 0.0)
        smallest = np.linalg.eigvalsh(tried)[:, 0]
        # The test is stricter than the schema, by the round-off. The schema decides.
        right = symmetric & (smallest > 4 * ROUND_OFF * np.abs(tried).max(axis=(1, 2)))
        for index in np.flatnonzero(~right):
            yield int(numbers[index]), {key: float(values[key][index]) for key in keys}


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


def _problem_with(plan: Plan, variant: str, values: dict[str, Any]) -> ConfigProblem | None:
    """Return the first problem of the base of a variant with these values of some varied keys."""
    try:
        changed_config(plan.bases[variant], plan.data_of(variant, values))
    except ConfigError as error:
        return error.problems[0]
    return None
