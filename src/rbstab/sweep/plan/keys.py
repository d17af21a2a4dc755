"""Check the varied keys of a plan: by themselves, against its base, and against changes of it."""

import re
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from rbstab.config.elements import declarations_of
from rbstab.config.errors import ConfigProblem, Location, closest_keys, describe, did_you_mean
from rbstab.config.model_keys import keys_of_variants
from rbstab.config.numbers import unit_problem, value_at, value_or_none
from rbstab.config.schema import Config
from rbstab.config.source import Path, key_of
from rbstab.config.units import names_in, number_key
from rbstab.sweep.plan.axes import VARIANT, VARIED_SECTIONS, Axis, VariedKey
from rbstab.sweep.plan.distributions import FiniteList, Member, Values
from rbstab.sweep.plan.plan import Plan
from rbstab.sweep.plan.plan_file import PlanFile, Problems

MAX_VARIED_KEYS = 200
"""Largest number of varied keys. No config has so many numbers."""

_NAME = re.compile(r"(?!point$)[A-Za-z][A-Za-z0-9_ -]*")
"""Valid names of a `zip`. They have no dots or brackets, and are valid in every file format."""

Wrong = tuple[Path, str, str]
"""The place of a wrong key in the plan, what is wrong, and what is expected."""


def check_axes(problems: Problems, file: PlanFile, *, grid: bool) -> tuple[Axis, ...]:
    """Return the axes of a plan without the wrong ones, whose problems are added.

    Args:
        problems: Collects the problems.
        file: The plan.
        grid: The design is a grid, so every axis must be a list.
    """
    axes = [Axis(name, varied) for name, varied in file.vary.items()]
    count = sum(len(axis.varied_keys) for axis in axes)
    if count > MAX_VARIED_KEYS:
        problems.add(("vary",), f"varies {count} keys", f"expected at most {MAX_VARIED_KEYS}")
        return ()
    wrong = {axis.name: [*_wrong_names(axis)] for axis in axes}
    right = tuple(axis for axis in axes if not wrong[axis.name])
    mistakes = [mistake for of_axis in wrong.values() for mistake in of_axis]
    mistakes += [mistake for axis in right for mistake in _wrong_lists(axis, grid=grid)]
    for place, problem, expected in (*mistakes, *_varied_twice(right)):
        problems.add(place, problem, expected, of_key=True)
    return right


def _wrong_names(axis: Axis) -> Iterator[Wrong]:
    """Yield the keys of an axis that may not vary, or not by what stands at them."""
    if axis.varied_keys[0].place[-2] == "zip" and not _NAME.fullmatch(axis.name):
        yield ("vary", axis.name), "is not a valid name of a zip", "expected words, but not `point`"
    for varied in axis.varied_keys:
        distribution, is_variant = varied.distribution, varied.path == VARIANT
        entries = distribution.root if isinstance(distribution, Values) else [0.0]
        named = {isinstance(entry, str) for entry in entries}
        if not varied.path or varied.path[0] not in VARIED_SECTIONS:
            candidates = [k for k in keys_of_variants() if k.partition(".")[0] in VARIED_SECTIONS]
            meant = closest_keys(varied.key.partition("[")[0], candidates)
            sections = f"expected a key of {', '.join(VARIED_SECTIONS)}"
            yield varied.place, "cannot vary", did_you_mean(meant) or sections
        elif is_variant and (varied.scale or named != {True}):
            yield varied.place, "is not a list of variants", "expected values: [variant, ...]"
        elif not is_variant and named != {False}:
            yield varied.place, "has names of variants", "expected numbers"


def _wrong_lists(axis: Axis, *, grid: bool) -> Iterator[Wrong]:
    """Yield what is no list where it must be one, and lists of an axis of other lengths."""
    if axis.each and grid:
        problem = "has no effect in a grid, which has every entry anyway"
        yield ("vary", axis.name, "each"), problem, "expected no `each`"
    for varied in axis.varied_keys:
        distribution = varied.distribution
        if not isinstance(distribution, FiniteList):
            if (grid or axis.each) and not axis.counts_members:
                why = "which a grid requires" if grid else "which `each` requires"
                lists = "expected values, linspace, logspace or geomspace"
                yield varied.place, f"is not a list, {why}", lists
        elif distribution.length != axis.length:
            problem = f"is a list of {distribution.length} where others have {axis.length}"
            yield varied.place, problem, "expected lists of equal length in a zip"


def _varied_twice(axes: Iterable[Axis]) -> Iterator[Wrong]:
    """Yield the keys that share numbers with one before them."""
    seen: list[VariedKey] = []
    for varied in (varied for axis in axes for varied in axis.varied_keys):
        for other in seen:
            short = min(len(other.path), len(varied.path))
            if other.path[:short] == varied.path[:short]:
                yield varied.place, f"varies the same values as {other.key}", "expected one of them"
                break
        seen.append(varied)


def check_names(problems: Problems, axes: Iterable[Axis]) -> None:
    """Add a problem for each varied key that no config has; the base, which is wrong, is not used.

    The keys of elements have names that only the base tells.
    """
    config_keys = keys_of_variants()
    for varied in (varied for axis in axes for varied in axis.varied_keys):
        if varied.path[0] != "elements" and key_of(names_in(varied.path)[:2]) not in config_keys:
            meant = did_you_mean(closest_keys(varied.key.partition("[")[0], config_keys))
            expected = meant or "expected a key of a config"
            problems.add(varied.place, "is in no config", expected, of_key=True)


def check_keys(problems: Problems, plan: Plan) -> None:
    """Add a problem for each varied key that no base has, or that cannot take numbers."""
    for varied in plan.varied_keys:
        if varied.path != VARIANT:
            for problem, expected in dict.fromkeys(_wrong_in_bases(plan, varied)):
                problems.add(varied.place, problem, expected, of_key=True)


def check_changes(problems: Problems, plan: Plan, changes: Iterable[str]) -> None:
    """Add a problem for each change of the base that no member sees, because the plan varies it.

    Args:
        problems: The problems so far; new ones are added.
        plan: The plan.
        changes: Texts `key=value` that replace single values of the base.
    """
    replaced = {varied.path for varied in plan.varied_keys if not varied.scale}
    for key in (text.partition("=")[0] for text in changes):
        read = number_key(key)
        path = () if read is None else read.path
        leaves = {leaf for data in plan.templates.values() for leaf in _leaves(data, path)}
        if leaves and leaves <= replaced:
            problem = "has no effect, because the plan varies it"
            expected = "expected a key that the plan does not vary"
            problems.append(ConfigProblem(Location(f"--set {key}"), key, problem, expected))


def _leaves(data: dict[str, Any], path: Path = ()) -> Iterator[Path]:
    """Yield the paths of all single values at a path of a base; none if there is no such."""
    value = value_or_none(data, path)
    if isinstance(value, dict | list):
        for part in value if isinstance(value, dict) else range(len(value)):
            yield from _leaves(data, (*path, part))
    elif value is not None:
        yield path


def _wrong_in_bases(plan: Plan, varied: VariedKey) -> Iterator[tuple[str, str]]:
    """Yield what is wrong with a varied key in the bases that have it, or that none has it."""
    owners = [variant for variant in plan.variants if varied in plan.varied_keys_of(variant)]
    if not owners:
        yield _missing(plan, varied)
    for variant in owners:
        base, value = plan.bases[variant], value_at(plan.templates[variant], varied.path)
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        actual = f"is {describe(value)} in the base"
        if varied.scale and not is_number and not isinstance(value, list):
            yield actual, "expected a number, a vector or a matrix"
        elif varied.scale and not np.any(value):
            yield "is zero in the base, where a scale has no effect", "expected another base"
        elif not varied.scale and isinstance(value, list):
            yield actual, f"expected one entry, as {varied.key}[0], or scale"
        elif not varied.scale and not is_number:
            yield actual, "expected a number, or controller.variant"
        elif varied.path[0] == "elements" and varied.path[-2:] == ("signal", "seed"):
            if not _counts(varied):
                yield "is a seed", "expected {member: [first]}, or a list of whole numbers"
        elif isinstance(value, int):
            yield "is a whole number, which all members share", "expected a key of another number"
        elif isinstance(varied.distribution, Member):
            yield "is no seed", "expected the seed of a noise for {member: [first]}"
        elif _is_left_out(varied, base):
            problem = "is varied, but the base has a spring of rest_length 0 without damping"
            yield problem, "expected a base with rest_length or damping above 0"
        if not varied.scale:
            yield from filter(None, [unit_problem(base, varied.number_key)])


def _missing(plan: Plan, varied: VariedKey) -> tuple[str, str]:
    """Return what is wrong with a key that no base has, and what may be meant."""
    templates = plan.templates.values()
    if varied.path[:2] == ("initial", "position") and any(
        template["initial"].get("attached") for template in templates
    ):
        expected = "expected another key, or a base without attached: true"
        return "follows from the orientation, as initial.attached is true in the base", expected
    leaves = [leaf for data in templates for leaf in _leaves(data)]
    base_keys = dict.fromkeys(key_of(path) for leaf in leaves for path in (leaf, names_in(leaf)))
    # The keys of another element are no help if the base has the element that was named.
    element = f"{key_of(varied.path[:2])}."
    element_keys = [
        key for key in base_keys if varied.path[0] == "elements" and key.startswith(element)
    ]
    meant = did_you_mean(closest_keys(varied.key, element_keys or base_keys))
    return "is not in the base", meant or "expected a key of the config"


def _counts(varied: VariedKey) -> bool:
    """Whether the values of a seed are whole numbers."""
    distribution = varied.distribution
    if not isinstance(distribution, FiniteList):
        return isinstance(distribution, Member)
    entries = distribution.at(np.arange(distribution.length))
    return bool((entries == np.round(entries)).all())


def _is_left_out(varied: VariedKey, base: Config) -> bool:
    """Whether a gain varies that the formulas of a spring in the base leave out."""
    if varied.path[0] != "elements" or varied.path[2:] not in (("rest_length",), ("damping",)):
        return False
    gains = declarations_of(base.elements[str(varied.path[1])]).gains
    return varied.path[2] not in {gain.name for gain in gains}
