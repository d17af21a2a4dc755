"""Read the distributions of a plan: `{linspace: [0, 1, 11]}`."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from rbstab.config.errors import hint
from rbstab.config.schema import VARIANTS
from rbstab.config.source import Path
from rbstab.sweep.plan.distributions import (
    Distribution,
    Geomspace,
    Linspace,
    Logspace,
    LogUniform,
    MemberNumber,
    Normal,
    Uniform,
    Values,
)
from rbstab.sweep.plan.problems import ProblemCollector


@dataclass(frozen=True)
class _Syntax:
    """The arguments of a distribution in a plan, and the condition on the first two."""

    shown: str
    make: Callable[..., Distribution]
    counted: bool
    allows: Callable[[float, float], bool]
    expected: str


def _finite_range(a: float, b: float) -> bool:
    return math.isfinite(b - a)


def _exponents(a: float, b: float) -> bool:
    return all(-308 <= exponent <= 308 for exponent in (a, b))


def _positive(a: float, b: float) -> bool:
    return a > 0 and b > 0


_COUNTED = "[first, last, count]"

_SYNTAX = {
    syntax.make.keyword: syntax  # type: ignore[attr-defined]
    for syntax in (
        _Syntax(_COUNTED, Linspace, True, _finite_range, "numbers whose difference is finite"),
        _Syntax(_COUNTED, Logspace, True, _exponents, "exponents of 10 from -308 to 308"),
        _Syntax(_COUNTED, Geomspace, True, _positive, "numbers greater than 0"),
        _Syntax("[a, b]", Uniform, False, lambda a, b: a < b, "a < b"),
        _Syntax("[mean, sd]", Normal, False, lambda _, sd: sd > 0, "a standard deviation above 0"),
        _Syntax("[a, b]", LogUniform, False, lambda a, b: 0 < a < b, "0 < a < b"),
    )
}

KEYWORDS = (Values.keyword, *_SYNTAX, MemberNumber.keyword)
"""The names of the distributions in a plan."""


def read_distribution(
    problems: ProblemCollector, path: Path, value: Any, *, names: bool
) -> Distribution | None:
    """Read a distribution; if it is wrong, add problems and return None.

    Args:
        problems: Collects the problems.
        path: The path of the mapping in the plan.
        value: The mapping.
        names: The entries are names of variants, not numbers.
    """
    expected = f"a mapping of one of {', '.join(KEYWORDS)}"
    if not isinstance(value, dict) or not value:
        problems.add_unexpected(path, value, expected)
        return None
    problems.add_unknown_keys(path, value, KEYWORDS)
    known = [keyword for keyword in value if keyword in KEYWORDS]
    if len(known) > 1:
        problems.add(path, f"has {' and '.join(known)}", f"expected {expected}")
    if len(known) != 1 or len(value) != 1:
        return None
    keyword, inside = known[0], (*path, known[0])
    if keyword == Values.keyword:
        return _values(problems, inside, value[keyword], names=names)
    if names:
        problems.add(inside, "is not a list of variants", "expected values: [variant, ...]")
        return None
    if keyword == MemberNumber.keyword:
        return _member_number(problems, inside, value[keyword])
    return _numbers(problems, inside, value[keyword], _SYNTAX[keyword])


def _member_number(problems: ProblemCollector, path: Path, value: Any) -> MemberNumber | None:
    if not isinstance(value, list) or len(value) != 1:
        problems.add_unexpected(path, value, "[first]")
        return None
    first = problems.read_integer((*path, 0), value[0], 0)
    return None if first is None else MemberNumber(first)


def _values(problems: ProblemCollector, path: Path, value: Any, *, names: bool) -> Values | None:
    if not isinstance(value, list) or not value:
        problems.add_unexpected(path, value, "a list of values")
        return None
    if names:
        return _variants(problems, path, value)
    indexed = problems.unless_full(enumerate(value))
    entries = [problems.read_number((*path, index), entry) for index, entry in indexed]
    numbers = tuple(entry for entry in entries if entry is not None)
    return Values(numbers) if len(numbers) == len(value) else None


def _variants(problems: ProblemCollector, path: Path, value: list[Any]) -> Values | None:
    """Read a list of variants.

    Add a problem for each unknown entry, and replace it by the first known variant. So the rest of
    the plan can still be checked.
    """
    found = [entry if isinstance(entry, str) and entry in VARIANTS else None for entry in value]
    for index, entry in problems.unless_full(enumerate(found)):
        if entry is None:
            expected = f"one of {', '.join(VARIANTS)}{hint(value[index], VARIANTS)}"
            problems.add_unexpected((*path, index), value[index], expected)
    first = next((entry for entry in found if entry is not None), None)
    return Values(tuple(entry or first for entry in found)) if first is not None else None


def _numbers(
    problems: ProblemCollector, path: Path, value: Any, syntax: _Syntax
) -> Distribution | None:
    if not isinstance(value, list):
        problems.add_unexpected(path, value, syntax.shown)
        return None
    wanted = 3 if syntax.counted else 2
    if len(value) != wanted:
        entries = "entry" if len(value) == 1 else "entries"
        problems.add(path, f"has {len(value)} {entries}", f"expected {syntax.shown}")
        return None
    a, b = (problems.read_number((*path, i), entry) for i, entry in enumerate(value[:2]))
    count = problems.read_integer((*path, 2), value[2], 1) if syntax.counted else 1
    if a is None or b is None or count is None:
        return None
    if not syntax.allows(a, b):
        problems.add(path, f"is [{a:.12g}, {b:.12g}]", f"expected {syntax.expected}")
        return None
    made = syntax.make(a, b, count) if syntax.counted else syntax.make(a, b)
    if not np.isfinite(made.bounds).all():
        problems.add(path, "exceeds the range of numbers", "expected finite values")
        return None
    return made
