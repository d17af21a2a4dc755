"""Check the varied keys of a plan: by themselves, against its base, and against changes of it."""

import re
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from rbstab.config.elements import declarations_of
from rbstab.config.errors import ConfigProblem, Location, closest, closest_keys, did_you_mean
from rbstab.config.messages import describe
from rbstab.config.numbers import unit_problem, value_at
from rbstab.config.schema import Config
from rbstab.config.source import Path, key_of
from rbstab.config.units import names_in, number_key
from rbstab.config.unknown_keys import keys_like, keys_of_variants
from rbstab.sweep.plan.axes import VARIANT, VARIED_SECTIONS, Axis, VariedKey
from rbstab.sweep.plan.distributions import FiniteList, Member, Values
from rbstab.sweep.plan.plan import Plan
from rbstab.sweep.plan.plan_file import PlanFile
from rbstab.sweep.plan.problems import ProblemCollector

MAX_VARIED_KEYS = 200
"""Largest number of varied keys. No config has so many numbers."""

_NAME = re.compile(r"(?!point$)[A-Za-z][A-Za-z0-9_ -]*")
"""Valid names of a `zip`. They have no dots or brackets, and are valid in every file format."""


def check_axes(problems: ProblemCollector, file: PlanFile, *, grid: bool) -> tuple[Axis, ...]:
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
    right = [axis for axis in axes if _has_right_keys(problems, axis)]
    for axis in right:
        _check_lists(problems, axis, grid=grid)
    seen: list[VariedKey] = []
    for varied in (varied for axis in right for varied in axis.varied_keys):
        for other in seen:
            short = min(len(other.path), len(varied.path))
            if other.path[:short] == varied.path[:short]:
                problem = f"varies the same values as {other.key}"
                problems.add(varied.place, problem, "expected each value once", of_key=True)
                break
        seen.append(varied)
    return tuple(right)


def _has_right_keys(problems: ProblemCollector, axis: Axis) -> bool:
    """Whether the keys of an axis may vary by what stands at them; if not, add problems."""
    before = len(problems.found)
    if axis.varied_keys[0].place[-2] == "zip" and not _NAME.fullmatch(axis.name):
        problem, expected = "is not a valid name of a zip", "expected words, but not `point`"
        problems.add(("vary", axis.name), problem, expected, of_key=True)
    for varied in axis.varied_keys:
        distribution = varied.distribution
        entries = distribution.root if isinstance(distribution, Values) else [0.0]
        named = [isinstance(entry, str) for entry in entries]
        if not varied.path or varied.path[0] not in VARIED_SECTIONS:
            problems.add(varied.place, "cannot vary", _expected_key(varied.key), of_key=True)
        elif varied.path == VARIANT and (varied.scale or not all(named)):
            expected = "expected values: [variant, ...]"
            problems.add(varied.place, "is not a list of variants", expected)
        elif varied.path != VARIANT and any(named):
            problems.add(varied.place, "has names of variants", "expected numbers")
    return len(problems.found) == before


def _expected_key(key: str) -> str:
    """Return what is expected instead of a key that is in none of the varied sections."""
    name, bracket, index = key.partition("[")
    entry = f"{bracket}{index}" if number_key(key) is not None else ""
    meant = [f"{k}{entry}" for k in keys_like(name) if k.partition(".")[0] in VARIED_SECTIONS]
    sections = f"{', '.join(VARIED_SECTIONS[:-1])} or {VARIED_SECTIONS[-1]}"
    return did_you_mean(meant) or f"expected a key of {sections}"


def _check_lists(problems: ProblemCollector, axis: Axis, *, grid: bool) -> None:
    """Check that a counted axis has lists only, and that all lists of an axis are equally long."""
    if axis.each and grid:
        problem = "has no effect in a grid, which has every entry anyway"
        problems.add(("vary", axis.name, "each"), problem, "expected no `each`", of_key=True)
    for varied in axis.varied_keys:
        distribution = varied.distribution
        if isinstance(distribution, FiniteList):
            if distribution.length != axis.length:
                problem = f"is a list of {distribution.length} where others have {axis.length}"
                problems.add(varied.place, problem, "expected lists of equal length in a zip")
        elif (grid or axis.each) and not axis.counts_members:
            why = "which a grid requires" if grid else "which `each` requires"
            lists = "values, linspace, logspace or geomspace"
            problems.add(varied.place, f"is not a list, {why}", f"expected {lists}")


def check_names(problems: ProblemCollector, axes: Iterable[Axis]) -> None:
    """Add a problem for each varied key that no config has; the base, which is wrong, is not used.

    The keys of elements have names that only the base tells.
    """
    known = keys_of_variants()
    for varied in (varied for axis in axes for varied in axis.varied_keys):
        if varied.path[0] != "elements" and key_of(names_in(varied.path)[:2]) not in known:
            expected = did_you_mean(closest_keys(varied.key, known)) or "expected a key of a config"
            problems.add(varied.place, "is in no config", expected, of_key=True)


def check_keys(problems: ProblemCollector, plan: Plan) -> None:
    """Add a problem for each varied key that no base has, or that cannot take numbers."""
    for varied in plan.varied_keys:
        if varied.path == VARIANT:
            continue
        owners = [v for v in plan.variants if varied in plan.varied_keys_of(v)]
        found = [None if owners else _missing(plan, varied)]
        for variant in owners:
            base, value = plan.bases[variant], value_at(plan.templates[variant], varied.path)
            found.append(_problem_with(varied, value))
            found.append(None if varied.scale else unit_problem(base, varied.number_key))
            found.append(_problem_with_spring(varied, base))
        for problem in dict.fromkeys(filter(None, found)):
            problems.add(varied.place, *problem, of_key=True)


def check_changes(problems: ProblemCollector, plan: Plan, changes: Iterable[str]) -> None:
    """Add a problem for each change of the base that no member sees, because the plan varies it."""
    replaced = {varied.path for varied in plan.varied_keys if not varied.scale}
    for text in changes:
        key = text.partition("=")[0]
        read = number_key(key)
        path = () if read is None else read.path
        leaves = {leaf for data in plan.templates.values() for leaf in _leaves(data, path)}
        if leaves and leaves <= replaced:
            problem = "has no effect, because the plan varies it"
            expected = "expected a key that the plan does not vary"
            problems.add_all([ConfigProblem(Location(f"--set {key}"), key, problem, expected)])


def _leaves(data: dict[str, Any], path: Path) -> Iterator[Path]:
    """Yield the paths of all single values at a path of a base; none if there is no such."""
    try:
        value = value_at(data, path)
    except LookupError:
        return
    if isinstance(value, dict | list):
        for part in value if isinstance(value, dict) else range(len(value)):
            yield from _leaves(data, (*path, part))
    else:
        yield path


def _problem_with(varied: VariedKey, value: Any) -> tuple[str, str] | None:
    """Return the problem and the expected value if a key cannot vary this value; else None."""
    described = f"is {describe(value)} in the base"
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if varied.scale:
        if not is_number and not isinstance(value, list):
            return described, "expected a number, a vector or a matrix"
        if not np.any(value):
            return "is zero in the base, where a scale has no effect", "expected another base"
    elif isinstance(value, list):
        return described, f"expected one entry, as {varied.key}[0], or scale"
    elif not is_number:
        return described, "expected a number, or controller.variant"
    return _problem_with_whole_number(varied, value)


def _problem_with_spring(varied: VariedKey, base: Config) -> tuple[str, str] | None:
    """Return the problem if a gain varies that the formulas of a spring in the base leave out."""
    if varied.path[0] != "elements" or varied.path[2:] not in (("rest_length",), ("damping",)):
        return None
    section = base.elements[str(varied.path[1])]
    if varied.path[2] in {gain.name for gain in declarations_of(section).gains}:
        return None
    problem = "is varied, but the base has a spring of rest_length 0 without damping"
    return problem, "expected a base with rest_length or damping above 0"


def _problem_with_whole_number(varied: VariedKey, value: Any) -> tuple[str, str] | None:
    """Return the problem if a whole number varies that is no seed, or not by whole numbers."""
    distribution = varied.distribution
    if varied.path[0] != "elements" or varied.path[-2:] != ("signal", "seed"):
        if isinstance(value, int):
            return "is a whole number, which all members share", "expected a key of another number"
        if isinstance(distribution, Member):
            return "is no seed", "expected the seed of a noise for {member: [first]}"
        return None
    expected = "expected {member: [first]}, or a list of whole numbers"
    if isinstance(distribution, Member):
        return None
    if not isinstance(distribution, FiniteList):
        return "is a seed, which cannot be drawn", expected
    entries = distribution.at(np.arange(distribution.length))
    return None if (entries == np.round(entries)).all() else ("is a seed", expected)


def _missing(plan: Plan, varied: VariedKey) -> tuple[str, str]:
    """Return the problem and the expected value of a key that no base has."""
    templates = plan.templates.values()
    attached = any(template["initial"].get("attached") for template in templates)
    if varied.path[:2] == ("initial", "position") and attached:
        return (
            "follows from the orientation, because initial.attached is true in the base",
            "expected another key, or a base without attached: true",
        )
    known = sorted(
        {
            key_of(path)
            for template in templates
            for section in VARIED_SECTIONS
            for leaf in _leaves(template, (section,))
            if isinstance(value_at(template, leaf), float)
            for path in (leaf[:end] for end in range(len(names_in(leaf)), len(leaf) + 1))
        }
    )
    element = f"{key_of(varied.path[:2])}."
    own = [key for key in known if varied.path[0] == "elements" and key.startswith(element)]
    # The keys of another element are no help if the base has the element that was named.
    close = closest_keys(varied.key, own or known)
    names = {key.rpartition(".")[2] for key in close}
    if own and closest(varied.key.rpartition(".")[2], names) is None:
        return "is not in the base", f"expected one of {', '.join(k for k in own if '[' not in k)}"
    return "is not in the base", did_you_mean(close) or "expected a key of the config"
