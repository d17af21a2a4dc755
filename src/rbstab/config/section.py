"""What every mapping of a config is made of."""

from difflib import get_close_matches
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
    value: Any, words: tuple[str, ...], *sections: tuple[type[Section], str]
) -> Any:
    """One of some words, or a section of one key, whose value has a meaning.

    Args:
        value: What the config says.
        words: The words.
        sections: Each a section and the meaning of its one value.

    Raises:
        PydanticCustomError: It is none of them.
    """
    by_key = {next(iter(section.model_fields)): section for section, _ in sections}
    shown = [f"{{{next(iter(section.model_fields))}: {meaning}}}" for section, meaning in sections]
    expected = f"expected {', '.join([*words, *shown[:-1]])} or {shown[-1]}"
    if isinstance(value, tuple(by_key.values())) or (isinstance(value, str) and value in words):
        return value
    if isinstance(value, dict):
        # A key that is only misspelt says which section is meant, too.
        close = [match for key in value for match in get_close_matches(str(key), by_key, n=1)]
        named = by_key[close[0]] if close else sections[0][0]
        return named.model_validate(value)
    if isinstance(value, str):
        raise complaint(f"'{value}' is unknown", expected)
    raise complaint("is neither a word nor a mapping", expected)
