"""Kinds of values in a config: numbers, vectors and matrices that make physical sense."""

import math
from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator, Discriminator, Field, Tag
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


def _storable(text: str) -> str:
    if "\0" in text:
        raise complaint("has a null character", "expected a text that HDF5 can hold")
    return text


Text = Annotated[str, Field(min_length=1, max_length=200), AfterValidator(_storable)]
LongText = Annotated[str, Field(max_length=1000), AfterValidator(_storable)]

# Not strict: a YAML list becomes a tuple, which is immutable. The numbers in it stay strict.
_THREE = Field(min_length=3, max_length=3, strict=False)


def _is_list(value: Any) -> Any:
    # Without this a set would be taken too, in whatever order it has.
    if not isinstance(value, list | tuple):
        raise PydanticCustomError("tuple_type", "no list")
    return value


_LIST = BeforeValidator(_is_list)

Vector = Annotated[tuple[Real, ...], _THREE, _LIST]
"""Three finite numbers."""

Diagonal = Annotated[tuple[Positive, ...], _THREE, _LIST]


ROUND_OFF = 1e-15
"""Error of eigenvalues relative to the largest entry: below it definiteness is not decided."""


def _symmetric_positive_definite(rows: tuple[Any, ...]) -> tuple[Any, ...]:
    # Imported late: numpy is not needed to print the schema.
    import numpy as np

    matrix = np.array(rows)
    if not (matrix == matrix.T).all():
        raise complaint("is not symmetric", "expected a symmetric matrix")
    smallest = float(np.linalg.eigvalsh(matrix)[0])
    largest = float(np.abs(matrix).max())
    if smallest <= -ROUND_OFF * largest:
        raise complaint(
            f"is not positive definite, its smallest eigenvalue is {smallest:.6g}",
            "expected positive eigenvalues",
        )
    if not smallest > ROUND_OFF * largest:
        raise complaint(
            "is not positive definite beyond round-off",
            f"expected a smallest eigenvalue above {ROUND_OFF:g} of the largest entry",
        )
    return rows


Matrix = Annotated[tuple[Vector, ...], _THREE, _LIST, AfterValidator(_symmetric_positive_definite)]


SHAPE_TAGS = ("<diagonal>", "<matrix>")
"""What pydantic puts into the path of an error inside `PositiveDefinite`; no key is called so."""


def _shape(value: Any) -> str:
    rows = isinstance(value, list | tuple) and len(value) > 0 and isinstance(value[0], list | tuple)
    return SHAPE_TAGS[1] if rows else SHAPE_TAGS[0]


PositiveDefinite = Annotated[
    Annotated[Diagonal, Tag(SHAPE_TAGS[0])] | Annotated[Matrix, Tag(SHAPE_TAGS[1])],
    Discriminator(_shape),
]
"""A symmetric positive definite 3x3 matrix: three numbers (its diagonal) or three rows."""


def _in_range(angles: Any) -> Any:
    names = ("θ1", "θ2", "θ3")
    limits = (math.pi, math.pi / 2, math.pi)
    words = ("π", "π/2", "π")
    outside, ranges = [], []
    for angle, name, limit, word in zip(angles, names, limits, words, strict=True):
        if abs(angle) > limit or (name == "θ2" and abs(angle) == limit):
            outside.append(f"{name} = {angle:g} rad")
            ranges.append(f"-{word} and {word}")
    if outside:
        hint = "; degrees?" if max(map(abs, angles)) > 2 * math.pi else ""
        verb = "is" if len(outside) == 1 else "are"
        raise complaint(
            f"{', '.join(outside)} {verb} outside the range of eq. 5{hint}",
            f"expected between {', '.join(ranges)}",
        )
    return angles


Orientation = Annotated[Vector, AfterValidator(_in_range)]
"""Θ, rad, inside the range of eq. 5."""
