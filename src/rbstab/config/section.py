"""What every mapping of a config is made of."""

from typing import Any

from pydantic import BaseModel, ConfigDict, Field

from rbstab.config.quantities import complaint


class Section(BaseModel):
    """A mapping of the config: no unknown keys, no conversions, immutable."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


def required(unit: str) -> Any:
    """A required key, described by what it is and its unit."""
    return Field(description=unit)


def word_or_section(
    value: Any, words: tuple[str, ...], section: type[Section], meaning: str
) -> Any:
    """One of some words, or a section of one key, whose value has a meaning.

    Raises:
        PydanticCustomError: It is neither.
    """
    (key,) = section.model_fields
    expected = f"expected {', '.join(words)} or {{{key}: {meaning}}}"
    if isinstance(value, section) or (isinstance(value, str) and value in words):
        return value
    if isinstance(value, dict):
        return section.model_validate(value)
    if isinstance(value, str):
        raise complaint(f"'{value}' is unknown", expected)
    raise complaint("is neither a word nor a mapping", expected)
