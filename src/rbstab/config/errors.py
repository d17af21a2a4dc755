"""Config errors: all problems of a config at once, each with its location."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any, NamedTuple

from rbstab.files.text import printable, shortened


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


MAX_PROBLEMS = 100
"""The largest number of problems in one error. If there are more, the last entry states how many
are left out."""


def closest(word: str, choices: Iterable[str]) -> str | None:
    """Return the known word that a misspelt one most likely means, or None.

    A difference in case, hyphens, underscores and spaces counts for nothing: `kt` means `K_t`. The
    beginning of a word means it, if it is the beginning of no other.
    """
    by_folded = {folded(name): name for name in reversed(list(choices))}
    close = get_close_matches(folded(word), by_folded, n=1)
    close = close or [name for name in by_folded if len(word) > 1 and name.startswith(folded(word))]
    return by_folded[close[0]] if len(close) == 1 else None


def did_you_mean(words: Sequence[str]) -> str:
    """Return the question whether some words were meant; empty without a word."""
    return f"did you mean {' or '.join(words)}?" if words else ""


def hint(value: Any, choices: Iterable[str]) -> str:
    """Return the end of a text that lists choices: a question, if a value is close to one."""
    close = closest(value, choices) if isinstance(value, str) else None
    return f"; {did_you_mean([close])}" if close is not None else ""


def keys_named(key: str, keys: Iterable[str]) -> list[str]:
    """Return the dotted keys with the same last name: `mass` and `initial.mass` are `body.mass`."""
    name = folded(_last_name(key))
    return [other for other in keys if folded(_last_name(other)) == name]


def closest_keys(key: str, choices: Iterable[str]) -> list[str]:
    """Return the dotted keys that a misspelt one may mean: `mas` and `bdy.mass` are `body.mass`.

    These are the keys whose last name is the same or the closest.
    """
    keys = list(choices)
    name = closest(_last_name(key), map(_last_name, keys))
    return [] if name is None else keys_named(name, keys)


def _last_name(key: str) -> str:
    return key.rpartition(".")[2]


def folded(word: str) -> str:
    """Return a word without case, hyphens, underscores and spaces, which count for nothing."""
    return "".join(c for c in word.lower() if c not in "_- ")


MAX_SHOWN_INTEGER = 10**15
"""Messages do not show the digits of whole numbers of at least this magnitude."""


def describe(value: Any) -> str:  # noqa: PLR0911 (one for each type)
    """Return a short description of a value, for messages; numbers have up to 12 digits."""
    if value is None:
        return "empty"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        shown = value if len(value) <= 40 else value[:37] + "..."
        return f"the text {shown!r}"
    if isinstance(value, dict):
        return "a mapping"
    if isinstance(value, list | tuple):
        return f"a list of {len(value)}"
    if isinstance(value, int) and abs(value) >= MAX_SHOWN_INTEGER:
        return "a whole number of more than 15 digits"
    name = type(value).__name__
    article = "an" if name[0].lower() in "aeio" else "a"
    return f"{value:.12g}" if isinstance(value, int | float) else f"{article} {name}"


def entries(value: Sequence[Any]) -> str:
    """Return how many entries a list has, in words."""
    return f"{len(value)} {'entry' if len(value) == 1 else 'entries'}"


ENOUGH_PROBLEMS = 10 * MAX_PROBLEMS
"""More problems are not described: a list of 100,000 wrong values would take seconds."""


class ConfigError(ValueError):
    """A config or a plan is invalid; the error lists all its problems.

    Args:
        problems: The problems, in any order. A search for them ends early at `ENOUGH_PROBLEMS`.

    Attributes:
        problems: The problems, ordered by location.
    """

    def __init__(self, problems: list[ConfigProblem]) -> None:
        ordered = sorted(problems)
        if len(ordered) > MAX_PROBLEMS:
            last = ordered[MAX_PROBLEMS - 1]
            more = f"{len(ordered) - MAX_PROBLEMS + 1} more problems are not listed"
            more = more if len(ordered) < ENOUGH_PROBLEMS else f"at least {more}"
            ordered = [*ordered[: MAX_PROBLEMS - 1], ConfigProblem(last.location, "", more, "")]
        self.problems = tuple(ordered)
        super().__init__("\n".join(str(problem) for problem in self.problems))

    @classmethod
    def at(cls, location: Location, problem: str, expected: str, key: str = "") -> "ConfigError":
        """Return the error of a single problem.

        Args:
            location: The place of the problem.
            problem: What is wrong.
            expected: What was expected instead.
            key: The key; "" if it has none.
        """
        return cls([ConfigProblem(location, key, problem, expected)])
