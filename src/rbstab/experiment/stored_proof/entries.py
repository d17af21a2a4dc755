"""What the models of a stored proof have in common: their base, and their small entries."""

from typing import Any

from pydantic import (
    BaseModel,
    ConfigDict,
    SerializerFunctionWrapHandler,
    model_serializer,
)

from rbstab.mechanics.numbers import Array

Triple = tuple[float, float, float]

Quadruple = tuple[float, float, float, float]

OF_ELEMENTS = ("brief", "closed", "degenerate", "every_start", "held", "on_rotations", "ridge")
"""Entries that a file has only where they say something."""


class Entry(BaseModel):
    """A part of a stored proof: it cannot be changed, and has no unknown entries."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    @model_serializer(mode="wrap")
    def _serialized(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out what only some elements have, so that all other files are as they were."""
        data: dict[str, Any] = handler(self)
        return {key: data[key] for key in data if key not in OF_ELEMENTS or data[key] is not None}


def triple(values: Array | list[float]) -> Triple:
    """Return three numbers as a tuple."""
    a, b, c = (float(value) for value in values)
    return a, b, c
