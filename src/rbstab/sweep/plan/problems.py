"""Collect the problems of a plan."""

import math
from collections.abc import Iterable, Iterator
from typing import Any, TypeVar

from rbstab.config.errors import MAX_PROBLEMS, ConfigProblem, closest, did_you_mean
from rbstab.config.messages import describe
from rbstab.config.quantities import whole
from rbstab.config.source import Path, Source, key_of

T = TypeVar("T")

ENOUGH_PROBLEMS = 10 * MAX_PROBLEMS
"""A search for problems ends here: a list of 100,000 wrong values would take seconds."""


class ProblemCollector:
    """Collects the problems that are found in the source of a plan.

    Args:
        source: The source, with the problems of its text.

    Attributes:
        found: All problems so far.
    """

    def __init__(self, source: Source) -> None:
        self.source = source
        self.found: list[ConfigProblem] = list(source.problems)
        self._already_wrong = {problem.location for problem in source.problems}

    @property
    def is_full(self) -> bool:
        """Whether enough problems are found. Then the entries of a list need no more checks."""
        return len(self.found) >= ENOUGH_PROBLEMS

    def add_all(self, problems: Iterable[ConfigProblem]) -> None:
        """Add problems, except at places that already have a problem of the text."""
        # An alias or a repeated key already has a message; its placeholder needs no second one.
        self.found += [p for p in problems if p.location not in self._already_wrong]

    def add(self, path: Path, problem: str, expected: str, *, of_key: bool = False) -> None:
        """Add a problem at a value or, with `of_key`, at its key."""
        where = self.source.location(path, of_key=of_key)
        self.add_all([ConfigProblem(where, key_of(path), problem, expected)])

    def add_unexpected(self, path: Path, value: Any, expected: str) -> None:
        """Add a problem that describes a wrong value, and states the expected one."""
        found = "empty" if value in ({}, []) else describe(value)
        self.add(path, f"is {found}", f"expected {expected}")

    def add_unknown_keys(self, path: Path, section: dict[str, Any], known: tuple[str, ...]) -> None:
        """Add a problem for each unknown key of a section."""
        for key in section:
            if key not in known:
                close = closest(key, known)
                one_of = f"expected one of {', '.join(known)}"
                expected = one_of if close is None else did_you_mean([close])
                self.add((*path, key), "is unknown", expected, of_key=True)

    def read_number(self, path: Path, value: Any) -> float | None:
        """Return a finite number as a float; otherwise add a problem and return None."""
        if isinstance(value, bool) or not isinstance(value, int | float):
            self.add_unexpected(path, value, "a number")
        elif not math.isfinite(value):
            self.add_unexpected(path, value, "a finite number")
        else:
            return float(value)
        return None

    def read_integer(self, path: Path, value: Any, minimum: int) -> int | None:
        """Return an integer that is at least `minimum`; otherwise add a problem and return None."""
        value = whole(value)
        if isinstance(value, bool) or not isinstance(value, int):
            found = repr(value) if isinstance(value, float) else describe(value)
            self.add(path, f"is {found}", "expected a whole number")
        elif value < minimum:
            self.add_unexpected(path, value, f"a number at least {minimum}")
        else:
            return value
        return None

    def unless_full(self, entries: Iterable[T]) -> Iterator[T]:
        """Yield the entries of a list until enough problems are found."""
        for entry in entries:
            if self.is_full:
                return
            yield entry
