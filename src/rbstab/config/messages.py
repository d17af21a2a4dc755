"""Errors of the validation library in the words of a config error."""

from collections.abc import Callable, Iterator
from difflib import get_close_matches
from typing import Any

from pydantic import BaseModel, ValidationError

from rbstab.config.errors import Problem
from rbstab.config.quantities import SHAPE_TAGS
from rbstab.config.schema import VARIANTS, Experiment
from rbstab.config.source import Path, Source, key_of

SHAPED = ("body", "controller")
"""The sections that hold matrices."""

Words = tuple[str, str]
"""What is wrong, and what was expected."""


def problems_of(error: ValidationError, source: Source, model: type[Experiment]) -> list[Problem]:
    """Every problem of a failed validation, with its place in the source.

    Args:
        error: What the validation raised.
        source: The data that was validated, with its places.
        model: The model that it was validated against.
    """
    found = error.errors(include_url=False)
    return [_problem(details, source, model) for details in found if not _repeats(details)]


def _repeats(details: Any) -> bool:
    """Whether a list is called too short only because its wrong entries were dropped."""
    return details["type"] == "too_short" and len(details["input"]) >= details["ctx"]["min_length"]


def _problem(details: Any, source: Source, model: type[Experiment]) -> Problem:
    path = _without_tag(details["loc"])
    unknown = details["type"] == "extra_forbidden"
    if unknown:
        problem, expected = _unknown_key(path, model)
    else:
        problem, expected = _WORDS.get(details["type"], _other)(details)
    where = source.location(path, of_key=unknown)
    return Problem(where, key_of(path), problem, expected)


def _without_tag(location: Path) -> Path:
    """The place of an error without the name of a shape, which stands behind a section and its key.

    Elsewhere the same text is a key of the file.
    """
    shaped = len(location) > 2 and location[0] in SHAPED and location[2] in SHAPE_TAGS
    return location[:2] + location[3:] if shaped else location


def _unknown_key(path: Path, model: type[Experiment]) -> Words:
    key, known = str(path[-1]), sorted(_keys_at(model, path[:-1]))
    owners = [name for name, other in VARIANTS.items() if key in _keys_at(other, path[:-1])]
    if owners:
        variant = next(name for name, other in VARIANTS.items() if other is model)
        return f"is no key of the variant {variant}", f"it belongs to {', '.join(owners)}"
    close = get_close_matches(key, known, n=1)
    if not close:
        folded = {name.lower().replace("_", ""): name for name in known}
        close = [folded[match] for match in (key.lower().replace("_", ""),) if match in folded]
    if close:
        return "is unknown", f"did you mean {close[0]}?"
    return "is unknown", f"expected one of {', '.join(known)}"


def _keys_at(model: type[BaseModel], path: Path) -> set[str]:
    """The keys that a mapping at a path of the schema may have."""
    models = [model]
    for part in path:
        models = [found for owner in models for found in _models_of(owner, part)]
    return {name for owner in models for name in owner.model_fields}


def _models_of(owner: type[BaseModel], key: str | int) -> Iterator[type[BaseModel]]:
    field = owner.model_fields.get(str(key))
    candidates = [field.annotation] if field is not None else []
    while candidates:
        candidate: Any = candidates.pop()
        if isinstance(candidate, type) and issubclass(candidate, BaseModel):
            yield candidate
        candidates += getattr(candidate, "__args__", ())


def described(value: Any) -> str:
    """A value in a few words, for messages."""
    if value is None:
        return "empty"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        shown = value if len(value) <= 40 else value[:37] + "..."
        return f"the text {shown!r}"
    if isinstance(value, dict):
        return "a mapping"
    if isinstance(value, list | tuple):
        return f"a list of {len(value)}"
    return _number(value) if isinstance(value, int | float) else f"a {type(value).__name__}"


def _number(value: float) -> str:
    """A number with the digits that tell it from others like it."""
    if isinstance(value, int) and abs(value) >= MAX_LENGTH:
        return "a whole number of more than 15 digits"
    return f"{value:.12g}"


MAX_LENGTH = 10**15
"""Whole numbers from here on are not written out."""


def _is_not(expected: str) -> Callable[[Any], Words]:
    def words(details: Any) -> Words:
        return f"is {described(details['input'])}", f"expected {expected}"

    return words


def _no_whole_number(details: Any) -> Words:
    value = details["input"]
    # 11.0 is shown with its point, which is what is wrong with it.
    found = repr(value) if isinstance(value, float) else described(value)
    return f"is {found}", "expected a whole number"


def _bound(relation: str, name: str) -> Callable[[Any], Words]:
    def words(details: Any) -> Words:
        limit = details["ctx"][name]
        return f"is {_number(details['input'])}", f"expected a number {relation} {limit:.12g}"

    return words


def _length(details: Any) -> Words:
    context = details["ctx"]
    found, wanted = len(details["input"]), context.get("min_length", context.get("max_length"))
    return f"has {found} {'entry' if found == 1 else 'entries'}", f"expected {wanted}"


def _text_length(details: Any) -> Words:
    context = details["ctx"]
    if "min_length" in context:
        return "is empty", "expected a text"
    return f"has {len(details['input'])} characters", f"expected at most {context['max_length']}"


def _choice(details: Any) -> Words:
    value, wanted = details["input"], details["ctx"]["expected"].replace("'", "")
    choices = wanted.replace(" or ", ", ").split(", ")
    close = get_close_matches(value, choices, n=1) if isinstance(value, str) else []
    hint = f", did you mean {close[0]}?" if close else ""
    return f"is {described(value)}", f"expected {wanted}{hint}"


def _other(details: Any) -> Words:
    return f"is {described(details['input'])}: {details['msg']}", "expected a valid value"


_WORDS: dict[str, Callable[[Any], Words]] = {
    "rbstab": lambda details: (details["ctx"]["problem"], details["ctx"]["expected"]),
    "missing": lambda _: ("is missing", "it is required"),
    "float_type": _is_not("a number"),
    "finite_number": _is_not("a finite number"),
    "int_type": _no_whole_number,
    "string_type": _is_not("a text"),
    "tuple_type": _is_not("a list of 3"),
    "model_type": _is_not("a mapping"),
    "greater_than": _bound("greater than", "gt"),
    "greater_than_equal": _bound("at least", "ge"),
    "less_than": _bound("less than", "lt"),
    "less_than_equal": _bound("at most", "le"),
    "too_short": _length,
    "too_long": _length,
    "string_too_short": _text_length,
    "string_too_long": _text_length,
    "literal_error": _choice,
}
