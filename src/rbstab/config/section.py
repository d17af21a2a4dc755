"""The base class of the config models, and helpers for their fields."""

from collections.abc import Callable
from math import radians
from typing import Any, NoReturn

from pydantic import BaseModel, ConfigDict, Field, WrapValidator
from pydantic_core import PydanticCustomError

from rbstab.config.errors import closest, hint
from rbstab.config.quantities import Real, Vector, check_range_of_degrees, value_error


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


class Degrees(Section):
    """Three angles in degrees, or three rates in degrees per second."""

    deg: Vector = required("the same three numbers in degrees")


class OneAngle(Section):
    """An angle in degrees."""

    deg: Real = required("the same number in degrees")


class VectorInDegrees(tuple[float, ...]):
    """Three numbers in radians (or radians per second) that the config gives in degrees."""

    __slots__ = ()


class NumberInDegrees(float):
    """A number in radians that the config gives in degrees."""

    __slots__ = ()


def _or_degrees(
    section: type[Section], kind: Any, check: Callable[[Any], None] | None = None
) -> WrapValidator:
    """Return a validator that converts `{deg: ...}` to radians before all other checks.

    So a config has radians only, and so has its identity. The type of the value tells the unit in
    which it was given, by which keys are read (`entries.degrees_key`).

    Args:
        section: The model of the value in degrees.
        kind: The type of the value in radians, for the JSON Schema.
        check: A check of the value in degrees, whose message has the numbers as they were given.
    """

    def in_radians(value: Any, handler: Callable[[Any], Any]) -> Any:
        if isinstance(value, str):
            # Such as 20deg: the message says how degrees are given.
            is_list = section is Degrees
            shown = "a list of 3, or {deg: [0, 20, 0]}" if is_list else "a number, or {deg: 20}"
            problem = "tuple_type" if is_list else "float_type"
            raise PydanticCustomError(problem, "a text", {"expected": shown})
        if not isinstance(value, dict):
            return handler(value)
        degrees: Any = section.model_validate(value)
        found = degrees.deg
        if check is not None:
            check(found)
        if isinstance(found, tuple):
            return VectorInDegrees(handler(tuple(map(radians, found))))
        return NumberInDegrees(handler(radians(found)))

    return WrapValidator(in_radians, json_schema_input_type=kind | section)


OR_DEGREES = _or_degrees(Degrees, Vector)
"""Lets a vector in radians, or in radians per second, be given as `{deg: [0, 10, 0]}`."""

OR_DEGREES_IN_RANGE = _or_degrees(Degrees, Vector, check_range_of_degrees)
"""The same for Θ, which must be in the range of eq. 5."""

OR_ONE_ANGLE = _or_degrees(OneAngle, Real)
"""Lets a number in radians be given as `{deg: 70}`."""


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
