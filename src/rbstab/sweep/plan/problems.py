"""What is wrong with a plan, collected while it is read."""

import math
from collections.abc import Iterable
from difflib import get_close_matches
from typing import Any

from rbstab.config.errors import Problem
from rbstab.config.messages import described
from rbstab.config.source import Path, Source, key_of


class ProblemCollector:
    """The source of a plan and its problems so far."""

    def __init__(self, source: Source) -> None:
        self.source = source
        self.problems: list[Problem] = list(source.problems)
        self._known = {problem.location for problem in source.problems}

    def add(self, problems: Iterable[Problem]) -> None:
        """Adds problems, but for those of what is wrong already as text."""
        # What stands in place of an alias or a repeated key is not worth a second complaint.
        self.problems += [p for p in problems if p.location not in self._known]

    def note(self, path: Path, problem: str, expected: str, *, of_key: bool = False) -> None:
        """Notes what is wrong with a value, or with its key."""
        where = self.source.location(path, of_key=of_key)
        self.add([Problem(where, key_of(path), problem, expected)])

    def is_no(self, path: Path, value: Any, expected: str) -> None:
        """Notes that a value is not what was expected."""
        found = "empty" if value in ({}, []) else described(value)
        self.note(path, f"is {found}", f"expected {expected}")

    def unknown_keys(self, path: Path, section: dict[str, Any], known: tuple[str, ...]) -> None:
        """Notes the keys of a section that it may not have."""
        for key in section:
            if key not in known:
                close = get_close_matches(key, known, n=1)
                one_of = f"expected one of {', '.join(known)}"
                hint = f"did you mean {close[0]}?" if close else one_of
                self.note((*path, key), "is unknown", hint, of_key=True)

    def number(self, path: Path, value: Any) -> float | None:
        """A finite number as a float, or None with a note."""
        if isinstance(value, bool) or not isinstance(value, int | float):
            self.is_no(path, value, "a number")
        elif not math.isfinite(value):
            self.is_no(path, value, "a finite number")
        else:
            return float(value)
        return None

    def whole(self, path: Path, value: Any, least: int) -> int | None:
        """A whole number that is not below some other, or None with a note."""
        if isinstance(value, bool) or not isinstance(value, int):
            found = repr(value) if isinstance(value, float) else described(value)
            self.note(path, f"is {found}", "expected a whole number")
        elif value < least:
            self.is_no(path, value, f"a number at least {least}")
        else:
            return value
        return None
