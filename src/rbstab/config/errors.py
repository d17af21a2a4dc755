"""Config errors: all problems of a config at once, each with its location."""

from dataclasses import dataclass
from typing import NamedTuple


class Location(NamedTuple):
    """A position in a source: the path of a file (or an option), line and column (from 1)."""

    source: str
    line: int = 1
    column: int = 1

    def __str__(self) -> str:
        return f"{self.source}:{self.line}:{self.column}"


@dataclass(frozen=True, order=True)
class ConfigProblem:
    """One problem of a config.

    Args:
        location: The position of the problem.
        key: The key with the problem; empty for the whole config.
        problem: The error, such as `is missing`.
        expected: The correct form, such as `expected a mapping`; may be empty.
    """

    location: Location
    key: str
    problem: str
    expected: str

    def __str__(self) -> str:
        """`file:line:column: key: what is wrong (what was expected)`."""
        key = f"{shortened(self.key)}: " if self.key else ""
        expected = f" ({self.expected})" if self.expected else ""
        return printable(f"{self.location}: {key}{shortened(self.problem)}{expected}")


MAX_TEXT = 200
"""Characters of a key, and of a problem, in a message. A file may have keys of any length."""


def shortened(text: str) -> str:
    """Return a text for a message, cut if it is long."""
    return text if len(text) <= MAX_TEXT else text[: MAX_TEXT - 3] + "..."


MAX_PROBLEMS = 100
"""The largest number of problems in one error. If there are more, the last entry states how many
are left out."""


def printable(text: str) -> str:
    """Escape line breaks and control characters of an untrusted text; the result is one line."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


class ConfigError(ValueError):
    """The error of an invalid config, with its problems.

    Args:
        problems: The problems, in any order.
        complete: Whether these are all problems; a search for problems may end early.

    Attributes:
        problems: The problems, ordered by location.
    """

    def __init__(self, problems: list[ConfigProblem], *, complete: bool = True) -> None:
        ordered = sorted(problems)
        if len(ordered) > MAX_PROBLEMS:
            last = ordered[MAX_PROBLEMS - 1]
            more = f"{len(ordered) - MAX_PROBLEMS + 1} more problems are not listed"
            more = more if complete else f"at least {more}"
            ordered = [*ordered[: MAX_PROBLEMS - 1], ConfigProblem(last.location, "", more, "")]
        self.problems = tuple(ordered)
        super().__init__("\n".join(str(problem) for problem in self.problems))
