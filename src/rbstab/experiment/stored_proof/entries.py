"""What the models of a stored proof have in common: their base, and their small entries."""

from typing import Annotated, Any

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    SerializerFunctionWrapHandler,
    model_serializer,
)

from rbstab.mechanics.numbers import Array

Triple = tuple[float, float, float]

Quadruple = tuple[float, float, float, float]

OF_ELEMENTS = (
    "barrier",
    "brief",
    "closed",
    "degenerate",
    "every_start",
    "formulas",
    "held",
    "ligaments",
    "lines",
    "on_rotations",
    "outer_barrier",
    "position",
    "ridge",
    "soft_guards",
)
"""Entries that a file has only with a guard, a spring, a ligament or an element of a user."""


class Entry(BaseModel):
    """A part of a stored proof: it cannot be changed, and has no unknown entries."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    @model_serializer(mode="wrap")
    def _serialized(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out what only some elements have, so that all other files are as they were."""
        data: dict[str, Any] = handler(self)
        return {key: data[key] for key in data if key not in OF_ELEMENTS or data[key] is not None}


Table = tuple[tuple[tuple[float, ...], ...], ...]
"""C of a sum Σ C_abc t_a(θ1) t_b(θ2) t_c(θ3), of shape (n, n, n) with an odd n."""


def _checked(table: Table) -> Table:
    """Raise `ValueError` if a table of coefficients has another shape."""
    size = len(table)
    rows = [row for block in table for row in block]
    if size % 2 != 1 or any(len(part) != size for part in (*table, *rows)):
        raise ValueError("the coefficients have another shape")
    return table


Coefficients = Annotated[Table, AfterValidator(_checked)]


def triple(values: Array | list[float]) -> Triple:
    """Return three numbers as a tuple."""
    a, b, c = (float(value) for value in values)
    return a, b, c
