"""The base class of the config models, and helpers for their fields."""

from collections.abc import Iterable
from typing import Any, NoReturn

from pydantic import BaseModel, ConfigDict, Field, WrapValidator

from rbstab.config.errors import closest, hint
from rbstab.config.quantities import value_error


class Section(BaseModel):
    """A mapping of a config: immutable, without unknown keys, without type conversions."""

    # Built when first used: a command needs the models of one variant only.
    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, defer_build=True)


class FrozenMapping(dict[str, Any]):
    """A mapping of a config that has no fixed keys: immutable, and with a hash like a section."""

    def __hash__(self) -> int:  # type: ignore[override]
        """Return a hash that does not depend on the order, as equality does not."""
        return hash(frozenset(self.items()))

    def __reduce__(self) -> tuple[Any, ...]:
        """Make the mapping at once, for pickle and copies: no item can be set later."""
        return type(self), (dict(self),)

    def _refuse(self, *_: Any, **__: Any) -> NoReturn:
        raise TypeError("a config cannot be changed")

    __setitem__ = __delitem__ = __ior__ = _refuse
    clear = pop = popitem = setdefault = update = _refuse


def required(description: str) -> Any:
    """Return the field of a required key."""
    return Field(description=description)


def section_of(value: dict[str, Any], sections: Iterable[type[Section]]) -> Section:
    """Validate a mapping with one key, as the section that has this key; a misspelt key is enough.

    Raises:
        PydanticCustomError: It has the keys of several sections.
    """
    by_key = {next(iter(section.model_fields)): section for section in sections}
    given = [key for key in by_key if key in value]
    if len(given) > 1:
        raise value_error(f"has {' and '.join(given)}", "expected one of them")
    near = filter(None, (closest(str(key), by_key) for key in value))
    return by_key[next(iter((*given, *near, *by_key)))].model_validate(value)


def word_or(words: tuple[str, ...], *sections: tuple[type[Section], str]) -> WrapValidator:
    """Return the check that a value is one of some words, or a section with one key.

    Args:
        words: The words.
        sections: The sections, each with the meaning of its one value.
    """
    kinds = tuple(section for section, _ in sections)
    shown = [f"{{{next(iter(kind.model_fields))}: {meaning}}}" for kind, meaning in sections]
    expected = f"expected {', '.join([*words, *shown[:-1]])} or {shown[-1]}"

    def check(value: Any, _: Any) -> Any:
        if isinstance(value, kinds) or (isinstance(value, str) and value in words):
            return value
        if isinstance(value, dict):
            return section_of(value, kinds)
        if isinstance(value, str):
            raise value_error(f"'{value}' is unknown", expected + hint(value, words))
        raise value_error("is neither a word nor a mapping", expected)

    return WrapValidator(check)
