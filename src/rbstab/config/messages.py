"""Translation of pydantic's validation errors into the problems of a config or a plan."""

from typing import Any

from pydantic import BaseModel, ValidationError

from rbstab.config.errors import ENOUGH_PROBLEMS, ConfigProblem, describe, entries, hint
from rbstab.config.model_keys import keys_of, keys_of_variants, models_at, unknown_key, words_of
from rbstab.config.numbers import value_at
from rbstab.config.schema import NO_VARIANT, VARIANTS, Experiment, model_of
from rbstab.config.source import Path, Source
from rbstab.config.user_code.section import PARAMETERS, parameters_in
from rbstab.elements.registry import SELECTORS

TAGGED = ("kind", *SELECTORS.values())
"""The keys whose words choose the model of a mapping."""

_OF_KEY = "[key]"
"""What pydantic adds to the path of an error in the key of a mapping."""

_EXPECTED = {
    "float_type": "a number",
    "finite_number": "a finite number",
    "int_type": "a whole number",
    "bool_type": "true or false",
    "string_type": "a text",
    "tuple_type": "a list",
    "model_attributes_type": "a mapping with the key kind",
    "greater_than": "a number greater than {gt:.12g}",
    "greater_than_equal": "a number at least {ge:.12g}",
    "less_than": "a number less than {lt:.12g}",
    "less_than_equal": "a number at most {le:.12g}",
    "string_too_long": "at most {max_length} characters",
}
"""What is expected, by the type of an error of pydantic, if its context does not say it."""


def problems_of(
    error: ValidationError, source: Source, model: type[BaseModel]
) -> list[ConfigProblem]:
    """Return the problems of a failed validation, at most `ENOUGH_PROBLEMS`, with their locations.

    Args:
        error: The error of the validation.
        source: The validated data, with its locations.
        model: The model of the config or of the plan.
    """
    errors = [e for e in error.errors(include_url=False) if not _is_redundant(e)]
    return [_problem(details, source, model) for details in errors[:ENOUGH_PROBLEMS]]


def _is_redundant(details: Any) -> bool:
    """Whether a list is "too short" only because pydantic dropped its invalid entries."""
    return details["type"] == "too_short" and len(details["input"]) >= details["ctx"]["min_length"]


def _problem(details: Any, source: Source, model: type[BaseModel]) -> ConfigProblem:
    location, kind = details["loc"], details["type"]
    unknown = kind == "extra_forbidden"
    # A file may have a key with the same text, which is then unknown.
    of_key = unknown or location[-1:] == (_OF_KEY,)
    path = _without_tags(location[:-1] if of_key and not unknown else location, source.data)
    if unknown:
        problem, expected = _unknown(location, path, source, model)
    elif kind.startswith("union_tag"):
        selector = details["ctx"]["discriminator"].strip("'")
        path, problem = (*path, selector), "is missing"
        choices = words_of(models_at(model, location), selector)
        expected = f"expected one of {', '.join(choices)}"
        if kind == "union_tag_invalid":
            value = details["input"][selector]
            problem, expected = f"is {describe(value)}", expected + hint(value, choices)
    else:
        # The sections of a config have too many keys for a line.
        keys = [] if issubclass(model, Experiment) else keys_of(models_at(model, location))
        problem, expected = _texts(details, keys)
    return source.problem(path, problem, expected, of_key=of_key)


def _unknown(location: Path, path: Path, source: Source, model: type[BaseModel]) -> tuple[str, str]:
    """Return the texts of an unknown key."""
    key = str(path[-1])
    if PARAMETERS in path[2:-1]:
        return unknown_key(key, sorted(parameters_in(value_at(source.data, path[:2]))))
    keys = keys_of(models_at(model, location[:-1]))
    if not issubclass(model, Experiment) or path[0] == "elements":
        return unknown_key(key, keys)
    owners = [v for v in VARIANTS if key in keys_of(models_at(model_of(v), path[:-1]))]
    if not owners:
        return unknown_key(key, keys, keys_of_variants())
    variant = next((name for name in VARIANTS if model_of(name) is model), NO_VARIANT)
    instead = "; here, `elements` hold the body" if variant == NO_VARIANT else ""
    problem = f"is not a key of the variant {variant}"
    return problem, f"it belongs to {', '.join(owners)}{instead}"


def _without_tags(location: Path, data: Any) -> Path:
    """Return the path of an error in the data without the tags of unions that pydantic adds."""
    path: list[str | int] = []
    for part in location:
        inner: dict[Any, Any] = data if isinstance(data, dict) else {}
        # Tags are the words that choose a model, and such as <matrix>; the same text may be a key.
        is_tag = part in map(inner.get, TAGGED) or str(part).startswith("<")
        if part in inner or isinstance(part, int) or not is_tag:
            path.append(part)
            is_entry = isinstance(data, list) and isinstance(part, int)
            data = data[part] if is_entry else inner.get(part)
    return tuple(path)


def _texts(details: Any, keys: list[str]) -> tuple[str, str]:  # noqa: PLR0911 (one for each kind)
    """Return what is wrong, and what is expected; `keys` are those of a mapping at the place."""
    kind, value, context = details["type"], details["input"], details.get("ctx", {})
    problem = f"is {describe(value)}"
    if kind == "rbstab":
        return context["problem"], context["expected"]
    if kind == "missing":
        return "is missing", "it is required"
    if kind in ("model_type", "dict_type"):
        return problem, "expected a mapping" + f" of {', '.join(keys)}" * bool(keys)
    if kind in ("too_short", "too_long"):
        wanted = context.get("min_length", context.get("max_length"))
        return f"has {entries(value)}", f"expected {wanted}"
    if kind == "string_too_short":
        return "is empty", "expected a text"
    if kind not in _EXPECTED and "expected" not in context:
        return f"{problem}: {details['msg']}", "expected a valid value"
    wanted = context.get("expected") or _EXPECTED[kind].format(**context)
    if kind == "string_too_long":
        problem = f"has {len(value)} characters"
    if kind == "literal_error":
        wanted = wanted.replace("'", "")
        wanted += hint(value, wanted.replace(" or ", ", ").split(", "))
    return problem, f"expected {wanted}"
