"""The distributions of a plan from its text: `{linspace: [0, 1, 11]}`."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from rbstab.config.schema import VARIANTS
from rbstab.config.source import Path
from rbstab.sweep.plan.distributions import (
    Distribution,
    Geomspace,
    Linspace,
    Logspace,
    LogUniform,
    Normal,
    Uniform,
    Values,
)
from rbstab.sweep.plan.problems import ProblemCollector


@dataclass(frozen=True)
class _Form:
    """How a distribution is written, and what its two numbers must be."""

    shown: str
    make: Callable[..., Distribution]
    counted: bool
    allows: Callable[[float, float], bool]
    expected: str


def _apart(a: float, b: float) -> bool:
    return math.isfinite(b - a)


def _powers(a: float, b: float) -> bool:
    return all(-308 <= exponent <= 308 for exponent in (a, b))


def _above_zero(a: float, b: float) -> bool:
    return a > 0 and b > 0


_FORMS = {
    form.make.word: form  # type: ignore[attr-defined]
    for form in (
        _Form("[first, last, count]", Linspace, True, _apart, "numbers that are not so far apart"),
        _Form("[first, last, count]", Logspace, True, _powers, "exponents of 10, at most 308"),
        _Form("[first, last, count]", Geomspace, True, _above_zero, "numbers greater than 0"),
        _Form("[a, b]", Uniform, False, lambda a, b: a < b, "a < b"),
        _Form("[mean, sd]", Normal, False, lambda _, sd: sd > 0, "a standard deviation above 0"),
        _Form("[a, b]", LogUniform, False, lambda a, b: 0 < a < b, "0 < a < b"),
    )
}

WORDS = (Values.word, *_FORMS)
"""The names of the distributions."""


def read_distribution(
    findings: ProblemCollector, path: Path, value: Any, *, names: bool
) -> Distribution | None:
    """A distribution, or None with notes of what is wrong.

    Args:
        findings: Where problems are noted.
        path: The place of the mapping.
        value: What stands there.
        names: The entries are variants.
    """
    expected = f"a mapping of one of {', '.join(WORDS)}"
    if not isinstance(value, dict) or not value:
        findings.is_no(path, value, expected)
        return None
    findings.unknown_keys(path, value, WORDS)
    known = [word for word in value if word in WORDS]
    if len(known) > 1:
        findings.note(path, f"has {' and '.join(known)}", f"expected {expected}")
    if len(known) != 1 or len(value) != 1:
        return None
    word, inside = known[0], (*path, known[0])
    if word == Values.word:
        return _values(findings, inside, value[word], names=names)
    if names:
        findings.note(inside, "is no list of variants", "expected values: [variant, ...]")
        return None
    return _numbers(findings, inside, value[word], _FORMS[word])


def _values(findings: ProblemCollector, path: Path, value: Any, *, names: bool) -> Values | None:
    if not isinstance(value, list) or not value:
        findings.is_no(path, value, "a list of values")
        return None
    if names:
        return _variants(findings, path, value)
    entries = [findings.number((*path, index), entry) for index, entry in enumerate(value)]
    numbers = tuple(entry for entry in entries if entry is not None)
    return Values(numbers) if len(numbers) == len(entries) else None


def _variants(findings: ProblemCollector, path: Path, value: list[Any]) -> Values | None:
    """A list of variants; what is none is noted and taken for one, so that others are checked."""
    known = [entry for entry in value if isinstance(entry, str) and entry in VARIANTS]
    for index, entry in enumerate(value):
        if entry not in known:
            findings.is_no((*path, index), entry, f"one of {', '.join(VARIANTS)}")
    entries = tuple(entry if entry in known else known[0] for entry in value) if known else ()
    return Values(entries) if entries else None


def _numbers(
    findings: ProblemCollector, path: Path, value: Any, form: _Form
) -> Distribution | None:
    if not isinstance(value, list):
        findings.is_no(path, value, form.shown)
        return None
    wanted = 3 if form.counted else 2
    if len(value) != wanted:
        entries = "entry" if len(value) == 1 else "entries"
        findings.note(path, f"has {len(value)} {entries}", f"expected {form.shown}")
        return None
    a, b = (findings.number((*path, i), entry) for i, entry in enumerate(value[:2]))
    count = findings.whole((*path, 2), value[2], 1) if form.counted else 1
    if a is None or b is None or count is None:
        return None
    if not form.allows(a, b):
        findings.note(path, f"is [{a:.12g}, {b:.12g}]", f"expected {form.expected}")
        return None
    made = form.make(a, b, count) if form.counted else form.make(a, b)
    if not np.isfinite(made.ends).all():
        findings.note(path, "leaves the range of numbers", "expected finite values")
        return None
    return made
