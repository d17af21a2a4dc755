"""Types of config values: validated numbers, texts, vectors and matrices."""

import math
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Discriminator, Field, Tag
from pydantic_core import PydanticCustomError

from rbstab.config.errors import describe


def value_error(problem: str, expected: str) -> PydanticCustomError:
    """Return a validation error with the two texts of a config problem."""
    return PydanticCustomError("rbstab", "{problem}", {"problem": problem, "expected": expected})


def _without_negative_zero(x: float) -> float:
    # -0.0 and 0.0 are equal, so they must give the same hash.
    return x + 0.0


Real = Annotated[float, Field(allow_inf_nan=False), AfterValidator(_without_negative_zero)]
NotNegative = Annotated[
    float, Field(ge=0, allow_inf_nan=False), AfterValidator(_without_negative_zero)
]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]


def whole(value: Any) -> Any:
    """Return a float without fraction as the whole number: 1e3, or a value that a plan varies."""
    return int(value) if isinstance(value, float) and value.is_integer() else value


def version(*versions: int) -> BeforeValidator:
    """Return the check of a schema version, which is one of some whole numbers."""

    def check(value: Any) -> Any:
        value = whole(value)
        # True equals 1, so a literal would accept it.
        if type(value) is not int or value not in versions:
            expected = f"expected {' or '.join(map(str, versions))}"
            problem = f"is {describe(value)}, which this version of rbstab cannot read"
            raise value_error(problem, expected)
        return value

    return BeforeValidator(check)


Whole = Annotated[int, BeforeValidator(whole)]
"""A whole number, also written as 1e3 or 1000.0."""

Count = Annotated[int, Field(ge=1), BeforeValidator(whole)]


def _without_null(text: str) -> str:
    if "\0" in text:
        raise value_error("has a null character", "expected a text that HDF5 can hold")
    return text


Text = Annotated[str, Field(min_length=1, max_length=200), AfterValidator(_without_null)]
LongText = Annotated[str, Field(max_length=1000), AfterValidator(_without_null)]

# With strict=False pydantic converts a YAML list to an immutable tuple. The check of its numbers
# stays strict.
_THREE = Field(min_length=3, max_length=3, strict=False)


def _list_of(size: int, expected: str = "") -> BeforeValidator:
    """Return a check that a value is a list; if it is another, one of that size is expected."""

    def check(value: Any) -> Any:
        # Otherwise pydantic would accept a set, whose order is arbitrary.
        if not isinstance(value, list | tuple):
            context = {"expected": expected or f"a list of {size}"}
            raise PydanticCustomError("tuple_type", "not a list", context)
        return value

    return BeforeValidator(check)


_LIST = _list_of(3)

Vector = Annotated[tuple[Real, ...], _THREE, _LIST]
"""Three finite numbers."""


SMALLEST_SQUARE, LARGEST_SQUARE = 1e-200, 1e200
"""Bounds on the square of the length of a direction: beyond them it is zero or infinite soon."""


def _check_direction(vector: Any) -> Any:
    if not any(vector):
        raise value_error("is zero, which has no direction", "expected a vector of any length")
    square = sum(entry * entry for entry in vector)
    if not SMALLEST_SQUARE < square < LARGEST_SQUARE:
        raise value_error("is too long or too short for a direction", "expected a vector near 1")
    return vector


Direction = Annotated[Vector, AfterValidator(_check_direction)]
"""Three finite numbers that are not all zero."""


def components(size: int) -> Any:
    """Return the type of a list of `size` finite numbers."""
    length = Field(min_length=size, max_length=size, strict=False)
    return Vector if size == 3 else Annotated[tuple[Real, ...], length, _list_of(size)]


Diagonal = Annotated[tuple[Positive, ...], _THREE, _list_of(3, "three numbers")]
"""Three positive numbers."""


SYMMETRIC = 1e-12
"""Entries of a symmetric matrix may differ by this, relative to the largest entry: so much is the
round-off of `R @ diag @ R.T`."""

ROUND_OFF = 1e-15
"""Error of computed eigenvalues, relative to the largest entry of the matrix. The sign of a smaller
eigenvalue is uncertain."""


def _symmetric(rows: tuple[Any, ...]) -> tuple[Any, ...]:
    below = {(i, j): rows[i][j] for i in range(3) for j in range(i)}
    largest = max(abs(entry) for row in rows for entry in row)
    if any(abs(x - rows[j][i]) > SYMMETRIC * largest for (i, j), x in below.items()):
        raise value_error("is not symmetric", "expected a symmetric matrix")
    mean = {(i, j): x + 0.5 * (rows[j][i] - x) for (i, j), x in below.items()}
    return tuple(
        tuple(mean.get((max(i, j), min(i, j)), rows[i][j]) for j in range(3)) for i in range(3)
    )


def _eigenvalue(gain: tuple[Any, ...]) -> tuple[float, float]:
    """Return the smallest eigenvalue of a diagonal or a matrix, and the largest entry."""
    # Imported here because printing the schema does not need numpy.
    import numpy as np

    matrix = np.array(gain)
    eigenvalues = np.linalg.eigvalsh(matrix) if matrix.ndim == 2 else matrix
    return float(eigenvalues.min()), float(np.abs(matrix).max())


def is_regular(gain: tuple[Any, ...]) -> bool:
    """Return whether a positive semidefinite matrix is definite beyond round-off."""
    smallest, largest = _eigenvalue(gain)
    return smallest > ROUND_OFF * largest


def _positive_definite(rows: tuple[Any, ...]) -> tuple[Any, ...]:
    smallest, largest = _eigenvalue(rows)
    if smallest <= ROUND_OFF * largest:
        beyond = "" if smallest <= -ROUND_OFF * largest else " beyond round-off"
        raise value_error(
            f"is not positive definite{beyond}, its smallest eigenvalue is {smallest:.6g}",
            f"expected more than {ROUND_OFF:g} times the largest entry",
        )
    return rows


def _positive_semidefinite(rows: tuple[Any, ...]) -> tuple[Any, ...]:
    smallest, largest = _eigenvalue(rows)
    if smallest < -ROUND_OFF * largest:
        raise value_error(
            f"is not positive semidefinite, its smallest eigenvalue is {smallest:.6g}",
            "expected no negative eigenvalue",
        )
    return rows


_SymmetricMatrix = Annotated[tuple[Vector, ...], _THREE, _LIST, AfterValidator(_symmetric)]


def _shape_tag(value: Any) -> str:
    rows = isinstance(value, list | tuple) and len(value) > 0 and isinstance(value[0], list | tuple)
    return "<matrix>" if rows else "<diagonal>"


_AS_MATRIX = _list_of(3, "three numbers or a 3x3 matrix")
"""The check of the diagonal of a matrix: what is not a list of rows is read as a diagonal."""


def _matrix(entry: Any, *checks: Any) -> Any:
    """Return the type of a symmetric 3x3 matrix, given as its diagonal or as three rows."""
    # `entry` is the type of an entry of the diagonal. The checks are those of three rows.
    diagonal = Annotated[tuple[entry, ...], _THREE, _AS_MATRIX, Tag("<diagonal>")]
    rows = Annotated[_SymmetricMatrix, *checks, Tag("<matrix>")]
    return Annotated[diagonal | rows, Discriminator(_shape_tag)]


Symmetric: Any = _matrix(Real)
"""A symmetric 3x3 matrix, given as its diagonal or as three rows."""

PositiveDefinite: Any = _matrix(Positive, AfterValidator(_positive_definite))
"""A symmetric positive definite 3x3 matrix, given in the same way."""

ZERO = (0.0, 0.0, 0.0)


def _three_zeros(value: Any) -> Any:
    is_zero = isinstance(value, int | float) and not isinstance(value, bool) and value == 0
    return ZERO if is_zero else value


_DiagonalOrRows: Any = _matrix(NotNegative, AfterValidator(_positive_semidefinite))

PositiveSemidefinite: Any = Annotated[
    _DiagonalOrRows,
    BeforeValidator(_three_zeros, json_schema_input_type=Literal[0] | _DiagonalOrRows),
]
"""A symmetric positive semidefinite 3x3 matrix, given in the same way, or as 0."""


_LIMITS = (math.pi, math.pi / 2, math.pi)


def _check_range(angles: Any) -> Any:
    outside = [
        f"θ{number} = {angle:.6g} rad ({math.degrees(angle):.6g}°)"
        for number, angle, limit in zip((1, 2, 3), angles, _LIMITS, strict=True)
        if abs(angle) > limit or abs(angle) == math.pi / 2 == limit
    ]
    if outside:
        verb = "is" if len(outside) == 1 else "are"
        raise value_error(
            f"{', '.join(outside)} {verb} outside the range of eq. 5",
            "expected θ1 and θ3 between ±180°, θ2 inside of ±90°; degrees are {deg: [...]}",
        )
    return angles


Orientation = Annotated[Vector, AfterValidator(_check_range)]
"""Θ, rad, in the range of eq. 5."""
