"""A plan as text that stands by itself: its base written out, every default of it filled in."""

from collections.abc import Iterable
from typing import Any

from rbstab.config.dump import as_yaml
from rbstab.sweep.plan.axes import Axis, Column
from rbstab.sweep.plan.bases import SHARED
from rbstab.sweep.plan.load import GRID
from rbstab.sweep.plan.plan import PLAN_VERSION, Plan
from rbstab.sweep.plan.trace_selection import TraceSelection


def plan_yaml(plan: Plan) -> str:
    """A plan as YAML, which loads again as the same plan, wherever it stands."""
    return as_yaml(plan_data(plan))


def plan_data(plan: Plan) -> dict[str, Any]:
    """The same as plain data."""
    design = plan.design
    drawn = {} if design is None else {"members": design.points, "seed": design.seed}
    return {
        "schema_version": PLAN_VERSION,
        "title": plan.title,
        "base": _base(list(plan.templates.values())),
        "vary": {axis.name: _axis(axis) for axis in plan.axes},
        "design": GRID if design is None else design.word,
        **drawn,
        "keep": _keep(plan.keep),
    }


def _base(bases: list[dict[str, Any]]) -> dict[str, Any]:
    """One base from those of the variants.

    A value in which variants differ is a default of theirs, or the name of the variant.
    """
    if len(bases) == 1:
        return bases[0]
    merged = dict(bases[0])
    for name in SHARED:
        sections = [base[name] for base in bases]
        keys = dict.fromkeys(key for section in sections for key in section)
        found = {key: _distinct(s[key] for s in sections if key in s) for key in keys}
        merged[name] = {key: values[0] for key, values in found.items() if len(values) == 1}
    return merged


def _distinct(values: Iterable[Any]) -> list[Any]:
    found: list[Any] = []
    for value in values:
        if value not in found:
            found.append(value)
    return found


def _axis(axis: Axis) -> dict[str, Any]:
    first = axis.columns[0]
    if len(axis.columns) == 1 and axis.name == first.key:
        found = _column(first)
    else:
        found = {"zip": {column.key: _column(column) for column in axis.columns}}
    return {"each": found} if axis.each else found


def _column(column: Column) -> dict[str, Any]:
    found: dict[str, Any] = {column.distribution.word: column.distribution.arguments}
    return {"scale": found} if column.scale else found


def _keep(keep: TraceSelection) -> Any:
    if keep.every == 1:
        return "traces"
    if keep.every:
        return {"traces": {"every": keep.every}}
    return {"traces": list(keep.members)} if keep.members else "summary"
