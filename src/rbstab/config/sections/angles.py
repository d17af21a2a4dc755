"""Angles as people write them: in degrees, as a quaternion, or as a rotation matrix.

A config has radians only, and so has its identity.
"""

from collections.abc import Callable
from functools import reduce
from math import radians
from operator import or_
from typing import Annotated, Any

from pydantic import Field, WrapValidator
from pydantic_core import PydanticCustomError

from rbstab.config.quantities import (
    Orientation,
    Real,
    Vector,
    components,
    value_error,
)
from rbstab.config.section import Section, required, section_of

ROTATION_ERROR = 1e-3
"""A given quaternion may differ from length 1 by this, and the products of the rows of a given
matrix from 1 and 0: so much is the rounding of numbers with few digits. It is then normalised."""

SINGULAR = 1e-6
"""Smallest cos θ2 at which θ1 and θ3 are read from a rotation: they lose digits in proportion."""


class Degrees(Section):
    """Three angles in degrees, or three rates in degrees per second."""

    deg: Vector = required("the same three numbers in degrees")


class AngleInDegrees(Section):
    """An angle in degrees."""

    deg: Real = required("the same number in degrees")


class Quaternion(Section):
    """An attitude as a unit quaternion."""

    quaternion: components(4) = required(  # type: ignore[valid-type]
        "w, x, y, z of the rotation A from body to inertial coordinates"
    )


class RotationMatrix(Section):
    """An attitude as a rotation matrix."""

    matrix: Annotated[tuple[Vector, ...], Field(min_length=3, max_length=3, strict=False)] = (
        required("the rows of the rotation A from body to inertial coordinates (eq. 2)")
    )


class VectorInDegrees(tuple[float, ...]):
    """Three numbers in radians (or radians per second) that the config gives in degrees."""

    __slots__ = ()


class NumberInDegrees(float):
    """A number in radians that the config gives in degrees."""

    __slots__ = ()


def _vector_in_radians(given: Degrees) -> VectorInDegrees:
    return VectorInDegrees(map(radians, given.deg))


def _number_in_radians(given: AngleInDegrees) -> NumberInDegrees:
    return NumberInDegrees(radians(given.deg))


def _angles_of_quaternion(given: Quaternion) -> tuple[float, ...]:
    # Imported late, here and below: few configs have quaternions or matrices.
    import numpy as np
    from scipy.spatial.transform import Rotation

    length = float(np.linalg.norm(given.quaternion))
    if not abs(length - 1) <= ROTATION_ERROR:
        raise value_error(
            f"has the length {length:.6g}", f"expected a unit quaternion, within {ROTATION_ERROR:g}"
        )
    return _angles_of(Rotation.from_quat(given.quaternion, scalar_first=True))


def _angles_of_matrix(given: RotationMatrix) -> tuple[float, ...]:
    import numpy as np
    from scipy.spatial.transform import Rotation

    A = np.array(given.matrix)
    with np.errstate(all="ignore"):
        error = float(np.abs(A @ A.T - np.eye(3)).max())
    if not error <= ROTATION_ERROR:
        problem = f"is no rotation: the products of its rows differ from 1 and 0 by {error:.3g}"
        raise value_error(problem, f"expected a rotation matrix, within {ROTATION_ERROR:g}")
    if np.linalg.det(A) < 0:
        raise value_error("is a reflection: its determinant is -1", "expected determinant 1")
    return _angles_of(Rotation.from_matrix(A))


def _angles_of(rotation: Any) -> tuple[float, ...]:
    """Return Θ, rad, of a rotation A = A1(θ1) A2(θ2) A3(θ3) (eq. 2); refuse θ2 = ±90°."""
    import numpy as np

    A = rotation.as_matrix()
    if np.hypot(A[0, 0], A[0, 1]) < SINGULAR:
        raise value_error(
            "has θ2 = ±90°, where the Euler angles θ1 and θ3 are not determined",
            "expected another attitude",
        )
    return tuple(rotation.as_euler("XYZ").tolist())


Form = tuple[type[Section], Callable[[Any], Any]]
"""A section in place of a value, and the function that returns the value, rad."""


def _or(kind: Any, problem: Any, expected: str, *forms: Form) -> WrapValidator:
    """Return a validator that takes some sections, each with one key, in place of a value."""
    read = dict(forms)

    def in_radians(value: Any, handler: Callable[[Any], Any]) -> Any:
        if isinstance(value, str):
            raise PydanticCustomError(problem, "a text", {"expected": expected})
        if not isinstance(value, dict):
            return handler(value)
        section = section_of(value, read)
        converted = read[type(section)](section)
        # This type tells the unit in which degrees were given (`unit_problem`).
        return type(converted)(handler(converted))

    sections = reduce(or_, read)
    # For the JSON Schema `kind` is the type of the value in radians.
    return WrapValidator(in_radians, json_schema_input_type=kind | sections)


_VECTOR = "tuple_type", "a list of 3, or {deg: [0, 20, 0]}"

OR_DEGREES = _or(Vector, *_VECTOR, (Degrees, _vector_in_radians))
"""Lets a vector in radians, or in radians per second, be given as `{deg: [0, 10, 0]}`."""

OR_ANGLE_IN_DEGREES = _or(
    Real, "float_type", "a number, or {deg: 20}", (AngleInDegrees, _number_in_radians)
)
"""Lets a number in radians be given as `{deg: 70}`."""

Attitude = Annotated[
    Orientation,
    _or(
        Vector,
        *_VECTOR,
        (Degrees, _vector_in_radians),
        (Quaternion, _angles_of_quaternion),
        (RotationMatrix, _angles_of_matrix),
    ),
]
"""Θ, rad, in the range of eq. 5; also given in degrees, as a quaternion or as a rotation matrix."""
