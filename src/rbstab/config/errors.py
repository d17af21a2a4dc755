"""Errors of a config: all of them at once, each with its place."""

from dataclasses import dataclass


@dataclass(frozen=True, order=True)
class Location:
    """A place in a source: a file's path (or the option it came from), line and column from 1."""

    source: str
    line: int = 1
    column: int = 1

    def __str__(self) -> str:
        return f"{self.source}:{self.line}:{self.column}"


@dataclass(frozen=True, order=True)
class Problem:
    """One thing that is wrong: where, at which key, what, and what was expected instead."""

    location: Location
    key: str
    problem: str
    expected: str

    def __str__(self) -> str:
        """`file:line:column: key: what is wrong (what was expected)`."""
        key = f"{self.key}: " if self.key else ""
        expected = f" ({self.expected})" if self.expected else ""
        return printable(f"{self.location}: {key}{self.problem}{expected}")


MAX_PROBLEMS = 100
"""A file with more is not a config; the rest is only counted."""


def printable(text: str) -> str:
    """A foreign text in one line, with what could steer a terminal spelled out."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


class ConfigError(ValueError):
    """A config that cannot be used, with everything that is wrong with it.

    Attributes:
        problems: The problems in the order of their places.
    """

    def __init__(self, problems: list[Problem]) -> None:
        ordered = sorted(problems)
        if len(ordered) > MAX_PROBLEMS:
            last = ordered[MAX_PROBLEMS - 1]
            more = f"{len(ordered) - MAX_PROBLEMS + 1} more problems are not listed"
            ordered = [*ordered[: MAX_PROBLEMS - 1], Problem(last.location, "", more, "")]
        self.problems = tuple(ordered)
        super().__init__("\n".join(str(problem) for problem in self.problems))
