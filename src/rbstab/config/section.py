"""The base class of the config models, and helpers for their fields."""

from typing import Any, NoReturn

from pydantic import BaseModel, ConfigDict, Field

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


def word_or_section(
    value: Any, words: tuple[str, ...], *sections: tuple[type[Section], str]
) -> Any:
    """Validate a value that must be one of some words, or a section with one key.

    Args:
        value: The value in the config.
        words: The allowed words.
        sections: The allowed sections, each with the meaning of its one value.

    Raises:
        PydanticCustomError: The value is none of these.
    """
    by_key = {next(iter(section.model_fields)): section for section, _ in sections}
    shown = [f"{{{next(iter(section.model_fields))}: {meaning}}}" for section, meaning in sections]
    expected = f"expected {', '.join([*words, *shown[:-1]])} or {shown[-1]}"
    if isinstance(value, tuple(by_key.values())) or (isinstance(value, str) and value in words):
        return value
    if isinstance(value, dict):
        # A misspelt key also selects its section, for a better message.
        close = next(filter(None, (closest(str(key), by_key) for key in value)), None)
        section = by_key[close] if close is not None else sections[0][0]
        return section.model_validate(value)
    if isinstance(value, str):
        raise value_error(f"'{value}' is unknown", expected + hint(value, words))
    raise value_error("is neither a word nor a mapping", expected)
