"""Whether what a plan varies is there in its base, and can take numbers."""

from collections.abc import Iterator
from difflib import get_close_matches
from typing import Any

from rbstab.config.messages import described
from rbstab.config.source import Path, key_of
from rbstab.sweep.plan.axes import VARIANT, Column, at
from rbstab.sweep.plan.plan import Plan
from rbstab.sweep.plan.problems import ProblemCollector
from rbstab.sweep.plan.read_vary import VARIED


def check_keys(findings: ProblemCollector, plan: Plan) -> None:
    """Notes each column whose key no base has, and each that is not for numbers."""
    for column in plan.columns:
        if column.path == VARIANT:
            continue
        owners = [v for v in plan.variants if column in plan.columns_of(v)]
        if not owners:
            findings.note(column.place, "is not in the base", _near(plan, column), of_key=True)
        values = [at(plan.templates[variant], column.path) for variant in owners]
        for problem in dict.fromkeys(_complaint(column, value) for value in values):
            if problem is not None:
                findings.note(column.place, *problem, of_key=True)


def _complaint(column: Column, value: Any) -> tuple[str, str] | None:
    """What keeps a column from varying a value of the base."""
    scalable = isinstance(value, list) or _is_number(value)
    if column.scale and not scalable:
        return f"is {described(value)} in the base", "expected a number, a vector or a matrix"
    if column.scale and not any(map(any, _rows(value))):
        return "is zero in the base, where a scale has no effect", "expected another base"
    if not column.scale and isinstance(value, list):
        return (
            f"is {described(value)} in the base",
            f"expected one entry, as {column.key}[0], or scale",
        )
    if not column.scale and not _is_number(value):
        return f"is {described(value)} in the base", "expected a number, or controller.variant"
    return None


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _rows(value: Any) -> list[list[float]]:
    """A number, a vector or a matrix as rows."""
    if not isinstance(value, list):
        return [[value]]
    return [row if isinstance(row, list) else [row] for row in value]


def _near(plan: Plan, column: Column) -> str:
    known = {
        key_of(path)
        for template in plan.templates.values()
        for section in VARIED
        for path in _paths(template[section], (section,))
    }
    close = get_close_matches(column.key, sorted(known), n=1)
    return f"did you mean {close[0]}?" if close else "expected a key of the config"


def _paths(value: Any, path: Path) -> Iterator[Path]:
    yield path
    if isinstance(value, dict | list):
        entries = value.items() if isinstance(value, dict) else enumerate(value)
        for part, entry in entries:
            yield from _paths(entry, (*path, part))
