"""Kinds of values in a config: numbers, vectors and matrices that make physical sense."""

import math
from typing import Annotated, Any

from pydantic import AfterValidator, Discriminator, Field, Tag
from pydantic_core import PydanticCustomError


def complaint(problem: str, expected: str) -> PydanticCustomError:
    """An error of a validator, in the two halves of a config error."""
    return PydanticCustomError("rbstab", "{problem}", {"problem": problem, "expected": expected})


def _without_negative_zero(x: float) -> float:
    # -0.0 and 0.0 are one value and must give one hash.
    return x + 0.0


Real = Annotated[float, Field(allow_inf_nan=False), AfterValidator(_without_negative_zero)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Count = Annotated[int, Field(ge=1)]
Text = Annotated[str, Field(min_length=1, max_length=200)]

# Not strict: a YAML list becomes a tuple, which is immutable. The numbers in it stay strict.
_THREE = Field(min_length=3, max_length=3, strict=False)

Vector = Annotated[tuple[Real, ...], _THREE]
"""Three finite numbers."""

Diagonal = Annotated[tuple[Positive, ...], _THREE]


def _symmetric_positive_definite(rows: tuple[Any, ...]) -> tuple[Any, ...]:
    # Imported late: numpy is not needed to print the schema.
    import numpy as np

    matrix = np.array(rows)
    if not (matrix == matrix.T).all():
        raise complaint("is not symmetric", "expected a symmetric matrix")
    smallest = float(np.linalg.eigvalsh(matrix)[0])
    # The eigenvalues carry an error of this order: below it definiteness is not decided.
    if not smallest > 1e-15 * float(np.abs(matrix).max()):
        raise complaint(
            f"is not positive definite, its smallest eigenvalue is {smallest:.6g}",
            "expected positive eigenvalues",
        )
    return rows


Matrix = Annotated[tuple[Vector, ...], _THREE, AfterValidator(_symmetric_positive_definite)]


def _shape(value: Any) -> str:
    rows = isinstance(value, list | tuple) and len(value) > 0 and isinstance(value[0], list | tuple)
    return "matrix" if rows else "diagonal"


PositiveDefinite = Annotated[
    Annotated[Diagonal, Tag("diagonal")] | Annotated[Matrix, Tag("matrix")],
    Discriminator(_shape),
]
"""A symmetric positive definite 3x3 matrix: three numbers (its diagonal) or three rows."""

SHAPE_TAGS = ("diagonal", "matrix")
"""What pydantic puts into the path of an error inside `PositiveDefinite`."""


def _in_range(angles: Any) -> Any:
    names = ("θ1", "θ2", "θ3")
    limits = (math.pi, math.pi / 2, math.pi)
    words = ("π", "π/2", "π")
    for angle, name, limit, word in zip(angles, names, limits, words, strict=True):
        outside = abs(angle) >= limit if name == "θ2" else abs(angle) > limit
        if outside:
            hint = "; degrees?" if abs(angle) > 2 * math.pi else ""
            raise complaint(
                f"{name} = {angle:g} rad is outside the range of eq. 5{hint}",
                f"expected between -{word} and {word}",
            )
    return angles


Orientation = Annotated[Vector, AfterValidator(_in_range)]
"""Θ, rad, inside the range of eq. 5."""
