"""Problems of a plan, each at its place in the file."""

from collections.abc import Iterable
from typing import Any, get_origin

from pydantic import BaseModel, ValidationError

from rbstab.config.errors import (
    MAX_PROBLEMS,
    ConfigError,
    ConfigProblem,
    closest,
    hint,
)
from rbstab.config.messages import describe, is_redundant, problem_texts
from rbstab.config.schema import VARIANTS
from rbstab.config.source import Path, Source, key_of
from rbstab.config.unknown_keys import models_of, with_hint
from rbstab.sweep.plan.axes import VARIANT
from rbstab.sweep.plan.plan_file import PlanFile, ReadablePlan

ENOUGH_PROBLEMS = 10 * MAX_PROBLEMS
"""More problems are not described: a list of 100,000 wrong values would take seconds."""

MISPLACED = {
    "each": ("is nested too deeply", "expected `each` outermost, and no `zip` in a `zip`"),
    "zip": ("is nested too deeply", "expected `each` outermost, and no `zip` in a `zip`"),
    "member": (
        "counts the members",
        "expected {member: [first]} at a key of its own, without scale, zip or each",
    ),
}
"""What is wrong with words of `vary` that stand where they cannot."""


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

    def add_all(self, problems: Iterable[ConfigProblem]) -> None:
        """Add problems, except at places that already have a problem of the text."""
        # An alias or a repeated key already has a message; its placeholder needs no second one.
        self.found += [p for p in problems if p.location not in self._already_wrong]

    def add(self, path: Path, problem: str, expected: str, *, of_key: bool = False) -> None:
        """Add a problem at a value or, with `of_key`, at its key."""
        where = self.source.location(path, of_key=of_key)
        self.add_all([ConfigProblem(where, key_of(path), problem, expected)])

    @property
    def is_full(self) -> bool:
        """Whether enough problems are found."""
        return len(self.found) >= ENOUGH_PROBLEMS

    def raise_if_any(self) -> None:
        """Raise a ConfigError with all problems, if there are any."""
        if self.found:
            raise ConfigError(self.found, complete=not self.is_full)

    def read(self) -> PlanFile:
        """Return what is right in the file, and add the problems of the rest."""
        data = self.source.data
        try:
            return PlanFile.model_validate(data)
        except ValidationError as error:
            wrong = error.errors(include_url=False)
        self._add_errors(wrong)
        places = {details["loc"][: 2 if details["loc"][0] == "vary" else 1] for details in wrong}
        right = {key: value for key, value in data.items() if (key,) not in places}
        if isinstance(right.get("vary"), dict):
            right["vary"] = {k: v for k, v in data["vary"].items() if ("vary", k) not in places}
        return ReadablePlan.model_validate(right)

    def _add_errors(self, errors: list[Any]) -> None:
        """Add the problems of a validation."""
        errors = [details for details in errors if not is_redundant(details)]
        meant: set[Path] = set()
        for details in errors[:ENOUGH_PROBLEMS]:
            path, unknown = details["loc"], details["type"] == "extra_forbidden"
            if unknown:
                known = _keys_at(path[:-1])
                meant.add((*path[:-1], closest(str(path[-1]), known) or ""))
                misplaced = MISPLACED if path[0] == "vary" and len(path) > 2 else {}
                texts = misplaced.get(path[-1]) or with_hint(path[-1], dict.fromkeys(known, ""))
            else:
                texts = texts_of(details)
            self.add(path, *texts, of_key=unknown)
        # A key that is misspelt is not missing as well.
        missing = {key_of(path) for path in meant}
        self.found = [p for p in self.found if p.problem != "is missing" or p.key not in missing]


def texts_of(details: Any) -> tuple[str, str]:
    """Return what is wrong, and what is expected."""
    kind, path, value = details["type"], details["loc"], details["input"]
    if kind in ("model_type", "dict_type") or (kind == "too_short" and not value):
        known = _keys_at(path)
        of = f"one of {', '.join(known)}" if known else "keys to their values"
        return f"is {describe(value) if value else 'empty'}", f"expected a mapping of {of}"
    if kind == "float_type" and key_of(VARIANT) in path:
        return (
            f"is {describe(value)}",
            f"expected one of {', '.join(VARIANTS)}{hint(value, VARIANTS)}",
        )
    return problem_texts(details)


def _keys_at(path: Path) -> list[str]:
    """Return the keys that the mapping at a path may have; none if it has keys of the config."""
    model: type[BaseModel] = PlanFile
    parts = iter(path)
    for part in parts:
        field = model.model_fields[str(part)]
        *_, model = models_of(model, part)  # the last one is that of what may be written
        if get_origin(field.annotation) is dict and next(parts, None) is None:
            return []
    return list(model.model_fields)
