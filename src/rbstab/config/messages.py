"""Translation of pydantic's validation errors into config problems."""

import re
from collections.abc import Callable
from typing import Any

from pydantic import ValidationError

from rbstab.config.errors import (
    ConfigProblem,
    hint,
)
from rbstab.config.numbers import value_at
from rbstab.config.quantities import SHAPE_TAGS
from rbstab.config.schema import Experiment
from rbstab.config.source import Path, Source, key_of
from rbstab.config.unknown_keys import unknown_key, with_hint, words_at
from rbstab.config.user_code.section import PARAMETERS, parameters_in
from rbstab.elements.registry import SELECTORS

TAGGED = ("kind", *SELECTORS.values())
"""The keys whose words choose the model of a mapping."""

_OF_KEY = "[key]"
"""What pydantic adds to the path of an error in the key of a mapping."""

ProblemText = tuple[str, str]
"""The texts `problem` and `expected` of a `ConfigProblem`."""


def problems_of(
    error: ValidationError, source: Source, model: type[Experiment]
) -> list[ConfigProblem]:
    """Return all problems of a failed validation, with their locations.

    Args:
        error: The error of the validation.
        source: The validated data, with its locations.
        model: The model of the config.
    """
    errors = error.errors(include_url=False)
    return [_problem(details, source, model) for details in errors if not is_redundant(details)]


def is_redundant(details: Any) -> bool:
    """Whether a list is "too short" only because pydantic dropped its invalid entries."""
    return details["type"] == "too_short" and len(details["input"]) >= details["ctx"]["min_length"]


def _problem(details: Any, source: Source, model: type[Experiment]) -> ConfigProblem:
    location, kind = details["loc"], details["type"]
    unknown = kind == "extra_forbidden"
    # A file may have a key with the same text, which is then unknown.
    of_key = unknown or location[-1:] == (_OF_KEY,)
    path = _without_tags(location[:-1] if of_key and not unknown else location, source.data)
    if unknown and PARAMETERS in path[2:-1]:
        element = value_at(source.data, path[:2])
        problem, expected = with_hint(str(path[-1]), dict(sorted(parameters_in(element).items())))
    elif unknown:
        problem, expected = unknown_key(location, path, model)
    elif kind in ("union_tag_not_found", "union_tag_invalid"):
        selector = details["ctx"]["discriminator"].strip("'")
        path = (*path, selector)
        choices = words_at(model, location, selector)
        problem = "is missing"
        expected = f"expected one of {', '.join(choices)}"
        if kind == "union_tag_invalid":
            value = details["input"][selector]
            problem, expected = f"is {describe(value)}", expected + hint(value, choices)
    else:
        problem, expected = problem_texts(details)
    where = source.location(path, of_key=of_key)
    return ConfigProblem(where, key_of(path), problem, expected)


def problem_texts(details: Any) -> ProblemText:
    """Return what is wrong and what is expected, by one of the errors of a validation."""
    return _TEXTS.get(details["type"], _other_error)(details)


def _without_tags(location: Path, data: Any) -> Path:
    """Return the path of an error in the data without the tags of unions that pydantic adds.

    They are the words that choose a model, and the tags of shapes; the same text may be a key.
    """
    path: list[str | int] = []
    for part in location:
        inner: Any = data if isinstance(data, dict | list) else {}
        is_key = part in inner if isinstance(inner, dict) else isinstance(part, int)
        chosen = list(map(inner.get, TAGGED)) if isinstance(inner, dict) else []
        if not is_key and (part in SHAPE_TAGS or part in chosen):
            continue
        path.append(part)
        entries: dict[Any, Any] = dict(enumerate(inner)) if isinstance(inner, list) else inner
        data = entries.get(part)
    return tuple(path)


def describe(value: Any) -> str:
    """Return a short description of a value, for messages."""
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
    return _number(value) if isinstance(value, int | float) else _with_article(type(value).__name__)


def _with_article(name: str) -> str:
    return f"{'an' if name[0].lower() in 'aeio' else 'a'} {name}"


def _number(value: float) -> str:
    """Return a number with up to 12 digits, so that close values look different."""
    if isinstance(value, int) and abs(value) >= MAX_SHOWN_INTEGER:
        return "a whole number of more than 15 digits"
    return f"{value:.12g}"


MAX_SHOWN_INTEGER = 10**15
"""Messages do not show the digits of whole numbers of at least this magnitude."""


_DECIMAL_COMMA = re.compile(r"[-+]?\d+,\d+")


def _wrong_type(expected: str) -> Callable[[Any], ProblemText]:
    def texts(details: Any) -> ProblemText:
        wanted = details.get("ctx", {}).get("expected", expected)
        value = details["input"]
        if isinstance(value, str) and _DECIMAL_COMMA.fullmatch(value):
            wanted += f"; with a decimal point: {value.replace(',', '.')}"
        return f"is {describe(value)}", f"expected {wanted}"

    return texts


def _not_a_list(details: Any) -> ProblemText:
    value, context = details["input"], details.get("ctx", {})
    expected = f"expected {context.get('expected', 'a list of 3')}"
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if context.get("for_all") and is_number and value > 0:
        expected += f"; [{', '.join([_number(value)] * 3)}] for all three axes"
    return f"is {describe(value)}", expected


def _not_whole(details: Any) -> ProblemText:
    value = details["input"]
    # The decimal point of 11.0 is the problem, so it is shown.
    found = repr(value) if isinstance(value, float) else describe(value)
    return f"is {found}", "expected a whole number"


def _out_of_bounds(relation: str, name: str) -> Callable[[Any], ProblemText]:
    def texts(details: Any) -> ProblemText:
        limit, value = details["ctx"][name], details["input"]
        return f"is {_number(value)}", f"expected a number {relation} {limit:.12g}"

    return texts


def _wrong_length(details: Any) -> ProblemText:
    context = details["ctx"]
    found, wanted = len(details["input"]), context.get("min_length", context.get("max_length"))
    return f"has {found} {'entry' if found == 1 else 'entries'}", f"expected {wanted}"


def _wrong_text_length(details: Any) -> ProblemText:
    context = details["ctx"]
    if "min_length" in context:
        return "is empty", "expected a text"
    return f"has {len(details['input'])} characters", f"expected at most {context['max_length']}"


def _not_a_choice(details: Any) -> ProblemText:
    value, wanted = details["input"], details["ctx"]["expected"].replace("'", "")
    choices = wanted.replace(" or ", ", ").split(", ")
    return f"is {describe(value)}", f"expected {wanted}{hint(value, choices)}"


def _other_error(details: Any) -> ProblemText:
    return f"is {describe(details['input'])}: {details['msg']}", "expected a valid value"


_TEXTS: dict[str, Callable[[Any], ProblemText]] = {
    "rbstab": lambda details: (details["ctx"]["problem"], details["ctx"]["expected"]),
    "missing": lambda _: ("is missing", "it is required"),
    "float_type": _wrong_type("a number"),
    "finite_number": _wrong_type("a finite number"),
    "int_type": _not_whole,
    "bool_type": _wrong_type("true or false"),
    "string_type": _wrong_type("a text"),
    "tuple_type": _not_a_list,
    "model_type": _wrong_type("a mapping"),
    "model_attributes_type": _wrong_type("a mapping with the key kind"),
    "greater_than": _out_of_bounds("greater than", "gt"),
    "greater_than_equal": _out_of_bounds("at least", "ge"),
    "less_than": _out_of_bounds("less than", "lt"),
    "less_than_equal": _out_of_bounds("at most", "le"),
    "too_short": _wrong_length,
    "too_long": _wrong_length,
    "string_too_short": _wrong_text_length,
    "string_too_long": _wrong_text_length,
    "literal_error": _not_a_choice,
}
