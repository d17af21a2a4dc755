"""What a plan varies, from its text: keys, `scale`, `each` and `zip`."""

import re
from typing import Any

from rbstab.config.overrides import parse_key
from rbstab.config.source import Path
from rbstab.sweep.plan.axes import VARIANT, Axis, Column
from rbstab.sweep.plan.distributions import FiniteList
from rbstab.sweep.plan.problems import ProblemCollector
from rbstab.sweep.plan.read_distribution import WORDS, read_distribution

VARIED = ("body", "gravity", "controller", "initial")
"""The sections whose numbers may vary; how a motion is followed is the same for all members."""

MAX_COLUMNS = 200
"""No config has as many numbers."""

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_ -]*")
"""Neither a key of a config nor anything that a file format might object to."""

_FORM = f"a mapping of one of {', '.join(WORDS)}, scale, each, zip"


def read_vary(findings: ProblemCollector, *, grid: bool) -> tuple[Axis, ...]:
    """The axes of a plan, without those that are wrong, of which there are notes.

    Args:
        findings: The plan, and where problems are noted.
        grid: Every axis must be a list.
    """
    vary = findings.source.data.get("vary")
    if not isinstance(vary, dict) or not vary:
        if "vary" in findings.source.data:
            findings.is_no(("vary",), vary, "a mapping of keys to their values")
        else:
            findings.note(("vary",), "is missing", "it is required")
        return ()
    found = [_axis(findings, name, value) for name, value in vary.items()]
    axes = tuple(axis for axis in found if axis is not None)
    columns = sum(len(axis.columns) for axis in axes)
    if columns > MAX_COLUMNS:
        findings.note(("vary",), f"moves {columns} values", f"expected at most {MAX_COLUMNS}")
        return ()
    for axis in axes:
        _check_lists(findings, axis, grid=grid)
    _check_disjoint(findings, axes)
    return axes


def _axis(findings: ProblemCollector, name: str, value: Any) -> Axis | None:
    path: Path = ("vary", name)
    each = isinstance(value, dict) and list(value) == ["each"]
    if each:
        path, value = (*path, "each"), value["each"]
    if not isinstance(value, dict) or not value:
        findings.is_no(path, value, _FORM)
        return None
    if "zip" not in value:
        column = _column(findings, path, name, value)
        return Axis(name, (column,), each) if column is not None else None
    findings.unknown_keys(path, value, ("zip",))
    if not _NAME.fullmatch(name) or name == "point":
        problem, expected = "is no name for what moves together", "expected words, but not `point`"
        findings.note(("vary", name), problem, expected, of_key=True)
    path, together = (*path, "zip"), value["zip"]
    if not isinstance(together, dict) or not together:
        findings.is_no(path, together, "a mapping of keys to their values")
        return None
    columns = [_column(findings, (*path, key), key, entry) for key, entry in together.items()]
    kept = tuple(column for column in columns if column is not None)
    return Axis(name, kept, each) if len(kept) == len(columns) else None


def _column(findings: ProblemCollector, place: Path, key: str, value: Any) -> Column | None:
    path = parse_key(key)
    if path is None or path[0] not in VARIED:
        expected = f"expected a key of {', '.join(VARIED[:-1])} or {VARIED[-1]}"
        findings.note(place, "cannot vary", expected, of_key=True)
        return None
    word = next(iter(value)) if isinstance(value, dict) and len(value) == 1 else ""
    scale = word == "scale"
    inside = (*place, word) if scale else place
    if word in ("each", "zip"):
        expected = "expected `each` outside, and no `zip` in another"
        findings.note((*place, word), "stands too deep", expected, of_key=True)
        return None
    if scale and path == VARIANT:
        findings.note(inside, "is no number", "expected values: [variant, ...]", of_key=True)
        return None
    inner = value["scale"] if scale else value
    distribution = read_distribution(findings, inside, inner, names=path == VARIANT)
    own = place[:-1] if place[-1] == "each" else place
    return Column(path, distribution, scale, own) if distribution is not None else None


def _check_lists(findings: ProblemCollector, axis: Axis, *, grid: bool) -> None:
    """A counted axis needs lists, and lists that move together are equally long."""
    if axis.each and grid:
        problem = "has no effect in a grid, which has every entry anyway"
        findings.note(("vary", axis.name, "each"), problem, "expected no `each`", of_key=True)
    for column in axis.columns:
        distribution = column.distribution
        if isinstance(distribution, FiniteList):
            if axis.length is not None and distribution.length != axis.length:
                entries = "entry" if distribution.length == 1 else "entries"
                found = f"has {distribution.length} {entries} where others have {axis.length}"
                findings.note(column.place, found, "expected as many of all that move together")
        elif grid or axis.each:
            where = "a grid" if grid else "each"
            lists = "values, linspace, logspace or geomspace"
            findings.note(column.place, f"is no list, as {where} needs", f"expected {lists}")


def _check_disjoint(findings: ProblemCollector, axes: tuple[Axis, ...]) -> None:
    """No two columns move the same value."""
    seen: list[Column] = []
    for axis in axes:
        for column in axis.columns:
            for other in seen:
                short = min(len(other.path), len(column.path))
                if other.path[:short] == column.path[:short]:
                    problem = f"moves what {other.key} moves"
                    findings.note(column.place, problem, "expected each value once", of_key=True)
                    break
            seen.append(column)
