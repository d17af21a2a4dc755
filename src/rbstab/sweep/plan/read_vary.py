"""Read the section `vary` of a plan: keys, `scale`, `each` and `zip`."""

import re
from typing import Any

from rbstab.config.errors import did_you_mean
from rbstab.config.source import Path
from rbstab.config.units import number_key
from rbstab.config.unknown_keys import keys_like
from rbstab.sweep.plan.axes import VARIANT, Axis, VariedKey
from rbstab.sweep.plan.distributions import FiniteList
from rbstab.sweep.plan.problems import ProblemCollector
from rbstab.sweep.plan.read_distribution import KEYWORDS, read_distribution

VARIED_SECTIONS = ("body", "gravity", "controller", "elements", "initial")
"""The sections whose numbers may vary. All members share the integration."""

MAX_VARIED_KEYS = 200
"""Largest number of varied keys. No config has so many numbers."""

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_ -]*")
"""Valid names of a `zip`. They have no dots or brackets, and are valid in every file format."""

_EXPECTED = f"a mapping of one of {', '.join(KEYWORDS)}, scale, each, zip"


def read_vary(problems: ProblemCollector, *, grid: bool) -> tuple[Axis, ...]:
    """Read the axes of a plan. Leave out wrong axes, and add their problems.

    Args:
        problems: The source of the plan; collects the problems.
        grid: The design is a grid, so every axis must be a list.
    """
    vary = problems.source.data.get("vary")
    if not isinstance(vary, dict) or not vary:
        if "vary" in problems.source.data:
            problems.add_unexpected(("vary",), vary, "a mapping of keys to their values")
        else:
            problems.add(("vary",), "is missing", "it is required")
        return ()
    found = [_axis(problems, name, value) for name, value in vary.items()]
    axes = tuple(axis for axis in found if axis is not None)
    count = sum(len(axis.varied_keys) for axis in axes)
    if count > MAX_VARIED_KEYS:
        problems.add(("vary",), f"varies {count} keys", f"expected at most {MAX_VARIED_KEYS}")
        return ()
    for axis in axes:
        _check_lists(problems, axis, grid=grid)
    _check_disjoint(problems, axes)
    return axes


def _axis(problems: ProblemCollector, name: str, value: Any) -> Axis | None:
    path: Path = ("vary", name)
    each = isinstance(value, dict) and list(value) == ["each"]
    if each:
        path, value = (*path, "each"), value["each"]
    if not isinstance(value, dict) or not value:
        problems.add_unexpected(path, value, _EXPECTED)
        return None
    if "zip" not in value:
        varied = _varied_key(problems, path, name, value)
        return Axis(name, (varied,), each) if varied is not None else None
    problems.add_unknown_keys(path, value, ("zip",))
    if not _NAME.fullmatch(name) or name == "point":
        problem, expected = "is not a valid name of a zip", "expected words, but not `point`"
        problems.add(("vary", name), problem, expected, of_key=True)
    path, group = (*path, "zip"), value["zip"]
    if not isinstance(group, dict) or not group:
        problems.add_unexpected(path, group, "a mapping of keys to their values")
        return None
    found = [_varied_key(problems, (*path, key), key, entry) for key, entry in group.items()]
    varied_keys = tuple(varied for varied in found if varied is not None)
    return Axis(name, varied_keys, each) if len(varied_keys) == len(found) else None


def _varied_key(problems: ProblemCollector, place: Path, key: str, value: Any) -> VariedKey | None:
    read = number_key(key)
    if read is None or read.path[0] not in VARIED_SECTIONS:
        problems.add(place, "cannot vary", _expected_key(key), of_key=True)
        return None
    word = next(iter(value)) if isinstance(value, dict) and len(value) == 1 else ""
    scale = word == "scale"
    inside = (*place, word) if scale else place
    if word in ("each", "zip"):
        expected = "expected `each` outermost, and no `zip` in a `zip`"
        problems.add((*place, word), "is nested too deeply", expected, of_key=True)
        return None
    counts = isinstance(inner := value["scale"] if scale else value, dict) and "member" in inner
    if counts and (scale or len(place) > 2):
        expected = "expected {member: [first]} at a key of its own, without scale, zip or each"
        problems.add(inside, "counts the members", expected, of_key=True)
        return None
    path = read.path
    if scale and path == VARIANT:
        problems.add(inside, "cannot scale names", "expected values: [variant, ...]", of_key=True)
        return None
    distribution = read_distribution(problems, inside, inner, names=path == VARIANT)
    own = place[:-1] if place[-1] == "each" else place
    return VariedKey(read, distribution, scale, own) if distribution is not None else None


def _expected_key(key: str) -> str:
    """Return what is expected instead of a key that is in none of the varied sections."""
    sections = f"{', '.join(VARIED_SECTIONS[:-1])} or {VARIED_SECTIONS[-1]}"
    name, bracket, index = key.partition("[")
    entry = f"{bracket}{index}" if number_key(key) is not None else ""
    meant = [f"{k}{entry}" for k in keys_like(name) if k.partition(".")[0] in VARIED_SECTIONS]
    return did_you_mean(meant) or f"expected a key of {sections}"


def _check_lists(problems: ProblemCollector, axis: Axis, *, grid: bool) -> None:
    """Check that a counted axis has lists only, and that all lists of an axis are equally long."""
    if axis.each and grid:
        problem = "has no effect in a grid, which has every entry anyway"
        problems.add(("vary", axis.name, "each"), problem, "expected no `each`", of_key=True)
    for varied in axis.varied_keys:
        distribution = varied.distribution
        if isinstance(distribution, FiniteList):
            if axis.length is not None and distribution.length != axis.length:
                entries = "entry" if distribution.length == 1 else "entries"
                problem = f"has {distribution.length} {entries} where others have {axis.length}"
                problems.add(varied.place, problem, "expected lists of equal length in a zip")
        elif (grid or axis.each) and not axis.counts_members:
            why = "which a grid requires" if grid else "which `each` requires"
            lists = "values, linspace, logspace or geomspace"
            problems.add(varied.place, f"is not a list, {why}", f"expected {lists}")


def _check_disjoint(problems: ProblemCollector, axes: tuple[Axis, ...]) -> None:
    """Check that no two keys vary the same value."""
    seen: list[VariedKey] = []
    for axis in axes:
        for varied in axis.varied_keys:
            for other in seen:
                short = min(len(other.path), len(varied.path))
                if other.path[:short] == varied.path[:short]:
                    problem = f"varies the same values as {other.key}"
                    problems.add(varied.place, problem, "expected each value once", of_key=True)
                    break
            seen.append(varied)
