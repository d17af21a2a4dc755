"""The keys that a config or a plan may have, as their models say, for messages about wrong ones."""

from collections.abc import Iterable, Iterator
from functools import cache
from typing import Any, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from rbstab.config.errors import closest, closest_keys, did_you_mean
from rbstab.config.schema import VARIANTS, model_of
from rbstab.config.source import Path


def unknown_key(key: str, keys: Iterable[str], elsewhere: Iterable[str] = ()) -> tuple[str, str]:
    """Return the problem of an unknown key, and what is expected.

    Args:
        key: The key.
        keys: The keys that may stand there.
        elsewhere: Dotted keys of other sections.
    """
    keys = list(keys)
    near = closest(key, keys)
    meant = closest_keys(key, elsewhere) if near is None else [near]
    listed = f"expected one of {', '.join(keys)}" if keys else "expected no key"
    return "is unknown", did_you_mean(meant) or listed


def models_at(model: type[BaseModel], location: Path) -> list[type[BaseModel]]:
    """Return the models that may stand at the location of an error, with the tags of its unions."""
    models, parts = [model], iter(location)
    for part in parts:
        fields = [owner.model_fields[str(part)] for owner in models if part in owner.model_fields]
        if not fields:
            is_tag = str(part).startswith("<")
            models = [owner for owner in models if is_tag or part in words_of([owner])]
            continue
        models = [inner for field in fields for inner in _models_in(field)]
        if get_origin(fields[0].annotation) is dict:
            next(parts, None)  # a name that the user chose
    return models


def keys_of(models: list[type[BaseModel]]) -> list[str]:
    """Return the keys of some models, in their order."""
    fields = [item for model in models for item in model.model_fields.items()]
    return list(dict.fromkeys(field.alias or name for name, field in fields))


def words_of(models: list[type[BaseModel]], key: str | None = None) -> list[Any]:
    """Return the words that a key, or any key, of some models may have."""
    fields = [model.model_fields for model in models]
    of_key = [f for some in fields for name, f in some.items() if key in (None, name)]
    return list(dict.fromkeys(word for field in of_key for word in get_args(field.annotation)))


@cache
def keys_of_variants() -> list[str]:
    """Return the dotted keys of the configs of all variants."""
    every = (key for variant in VARIANTS for key in _dotted_keys(model_of(variant)))
    return list(dict.fromkeys(every))


def _dotted_keys(model: type[BaseModel], above: str = "") -> Iterator[str]:
    """Yield the keys of a config, without those that are rarely meant."""
    for name, field in model.model_fields.items():
        if name not in ("elements", "reference"):
            yield f"{above}{name}"
            for section in _models_in(field):
                yield from _dotted_keys(section, f"{above}{name}.")


def _models_in(field: FieldInfo) -> Iterator[type[BaseModel]]:
    """Yield the models of a field, which its value may be, also those of its input only."""
    # A validator may take a mapping in place of the value, such as {deg: [0, 10, 0]}.
    inputs = [getattr(data, "json_schema_input_type", None) for data in field.metadata]
    candidates: list[Any] = [field.annotation, *inputs]
    while candidates:
        candidate = candidates.pop(0)
        if isinstance(candidate, type) and issubclass(candidate, BaseModel):
            yield candidate
        candidates += getattr(candidate, "__args__", ())
