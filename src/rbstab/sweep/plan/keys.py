"""Check the varied keys of a plan against its base, and against changes of the base."""

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from rbstab.config.elements import declarations_of
from rbstab.config.errors import ConfigProblem, Location, closest, closest_keys, did_you_mean
from rbstab.config.messages import describe
from rbstab.config.numbers import unit_problem, value_at
from rbstab.config.schema import VARIANTS, Config, model_of
from rbstab.config.source import Path, key_of
from rbstab.config.units import number_key
from rbstab.sweep.plan.axes import VARIANT, Axis, VariedKey
from rbstab.sweep.plan.distributions import FiniteList, MemberNumber
from rbstab.sweep.plan.plan import Plan
from rbstab.sweep.plan.problems import ProblemCollector
from rbstab.sweep.plan.read_vary import VARIED_SECTIONS

NAMED_SECTIONS = ("body", "controller", "initial")
"""The sections with the same names of keys in all configs of a variant."""


def check_keys(problems: ProblemCollector, plan: Plan) -> None:
    """Add a problem for each varied key that no base has, or that cannot take numbers."""
    for varied in plan.varied_keys:
        if varied.path == VARIANT:
            continue
        owners = [v for v in plan.variants if varied in plan.varied_keys_of(v)]
        if not owners:
            problems.add(varied.place, *_missing(plan, varied), of_key=True)
        values = [value_at(plan.templates[variant], varied.path) for variant in owners]
        found = [_problem_with(varied, value) for value in values]
        if not varied.scale:
            found += [unit_problem(plan.bases[variant], varied.number_key) for variant in owners]
        found += [_problem_with_spring(varied, plan.bases[variant]) for variant in owners]
        for problem in dict.fromkeys(found):
            if problem is not None:
                problems.add(varied.place, *problem, of_key=True)


def check_names(problems: ProblemCollector, axes: Iterable[Axis]) -> None:
    """Add a problem for each varied key that no config has; the base, which is wrong, is not used.

    The keys of elements have names that only the base tells.
    """
    known = {
        section: {
            name
            for model in map(model_of, VARIANTS)
            for name in getattr(model.model_fields[section].annotation, "model_fields", ())
        }
        for section in NAMED_SECTIONS
    }
    keys = [f"{section}.{name}" for section, names in known.items() for name in sorted(names)]
    for varied in (varied for axis in axes for varied in axis.varied_keys):
        section, name = varied.path[0], varied.path[1] if len(varied.path) > 1 else None
        if section in NAMED_SECTIONS and name is not None and name not in known[str(section)]:
            expected = did_you_mean(closest_keys(varied.key, keys)) or "expected a key of a config"
            problems.add(varied.place, "is in no config", expected, of_key=True)


def check_changes(problems: ProblemCollector, plan: Plan, changes: Iterable[str]) -> None:
    """Add a problem for each change of the base that no member sees, because the plan varies it."""
    replaced = {varied.path for varied in plan.varied_keys if not varied.scale}
    for text in changes:
        key = text.partition("=")[0]
        read = number_key(key)
        if read is None:
            continue
        leaves = {leaf for variant in plan.variants for leaf in _leaves(plan, variant, read.path)}
        if leaves and leaves <= replaced:
            problem = "has no effect, because the plan varies it"
            expected = "expected a key that the plan does not vary"
            problems.add_all([ConfigProblem(Location(f"--set {key}"), key, problem, expected)])


def _leaves(plan: Plan, variant: str, path: Path) -> list[Path]:
    """Return the paths of all single values at a path of a variant; none if there is no such."""
    template = plan.templates[variant]
    try:
        found = _paths(value_at(template, path), path)
    except LookupError:
        return []
    return [leaf for leaf in found if not isinstance(value_at(template, leaf), dict | list)]


def _problem_with(varied: VariedKey, value: Any) -> tuple[str, str] | None:
    """Return the problem and the expected value if a key cannot vary this value; else None."""
    scalable = isinstance(value, list) or _is_number(value)
    if varied.scale and not scalable:
        return f"is {describe(value)} in the base", "expected a number, a vector or a matrix"
    if varied.scale and not any(map(any, _rows(value))):
        return "is zero in the base, where a scale has no effect", "expected another base"
    if not varied.scale and isinstance(value, list):
        return (
            f"is {describe(value)} in the base",
            f"expected one entry, as {varied.key}[0], or scale",
        )
    if not varied.scale and not _is_number(value):
        return f"is {describe(value)} in the base", "expected a number, or controller.variant"
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
    is_seed = varied.path[0] == "elements" and varied.path[-2:] == ("signal", "seed")
    if isinstance(value, int) and not is_seed:
        return "is a whole number, which all members share", "expected a key of another number"
    distribution = varied.distribution
    counts = isinstance(distribution, MemberNumber)
    if counts and not is_seed:
        return "is no seed", "expected the seed of a noise for {member: [first]}"
    if not is_seed or counts:
        return None
    expected = "expected {member: [first]}, or a list of whole numbers"
    if not isinstance(distribution, FiniteList):
        return "is a seed, which cannot be drawn", expected
    entries = distribution.at(np.arange(distribution.length))
    return None if (entries == np.round(entries)).all() else ("is a seed", expected)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _rows(value: Any) -> list[list[float]]:
    """Return a number, a vector or a matrix as rows."""
    if not isinstance(value, list):
        return [[value]]
    return [row if isinstance(row, list) else [row] for row in value]


def _missing(plan: Plan, varied: VariedKey) -> tuple[str, str]:
    """Return the problem and the expected value of a key that no base has."""
    if varied.path[:2] == ("initial", "position") and _is_attached(plan):
        return (
            "follows from the orientation, because initial.attached is true in the base",
            "expected another key, or a base without attached: true",
        )
    return "is not in the base", _hint(plan, varied)


def _is_attached(plan: Plan) -> bool:
    return any(template["initial"].get("attached") for template in plan.templates.values())


def _hint(plan: Plan, varied: VariedKey) -> str:
    """Return what is expected of a key that no base has: a similar key that can vary."""
    known = {
        key_of(path)
        for template in plan.templates.values()
        for section in VARIED_SECTIONS
        if section in template
        for path in _paths(template[section], (section,))
        if _has_numbers(value_at(template, path))
    }
    element = f"{key_of(varied.path[:2])}." if varied.path[0] == "elements" else None
    own = sorted(key for key in known if element is not None and key.startswith(element))
    # The keys of another element are no help if the base has the element that was named.
    close = closest_keys(varied.key, own or sorted(known))
    wholes = [key for key in own if "[" not in key]
    if wholes and not _names_agree(varied.key, close):
        return f"expected one of {', '.join(wholes)}"
    return did_you_mean(close) or "expected a key of the config"


def _names_agree(key: str, close: list[str]) -> bool:
    """Whether the close keys are close by their last names, and not only as whole texts."""
    names = {other.rpartition(".")[2] for other in close}
    return closest(key.rpartition(".")[2], names) is not None


def _has_numbers(value: Any) -> bool:
    """Whether a value is a number, a vector or a matrix."""
    return all(map(_has_numbers, value)) if isinstance(value, list) else _is_number(value)


def _paths(value: Any, path: Path) -> Iterator[Path]:
    yield path
    if isinstance(value, dict | list):
        entries = value.items() if isinstance(value, dict) else enumerate(value)
        for part, entry in entries:
            yield from _paths(entry, (*path, part))
