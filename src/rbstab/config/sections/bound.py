"""The section of disturbances that must never tilt a body far; only proofs depend on it."""

import math
from typing import Annotated

from pydantic import AfterValidator, ConfigDict, Field, ValidationInfo, field_validator

from rbstab.config.quantities import Positive, Vector, value_error
from rbstab.config.section import Section, required
from rbstab.config.sections.angles import OR_ANGLE_IN_DEGREES

LEAST, MOST = 1e-9, 1e9
"""Loads are between these, and so are distances of their points, but for zero."""

Size = Annotated[float, Field(ge=LEAST, le=MOST, allow_inf_nan=False)]


def _check_tilt(tilt: float) -> float:
    if tilt >= math.pi / 2:
        degrees = f"{math.degrees(tilt):.6g}"
        raise value_error(f"is {degrees}°", "expected less than 90°; degrees are {deg: 30}")
    return tilt


class BoundSection(Section):
    """All disturbances up to some sizes are to keep the tilt of the body below an angle for ever.

    The tilt is the angle of the rotation from Θ = 0.
    """

    model_config = ConfigDict(
        json_schema_extra={
            "anyOf": [{"required": ["couple"]}, {"required": ["force"]}],
            "dependentRequired": {"point": ["force"]},
        }
    )

    couple: Size | None = Field(None, description="largest couple, N m")
    force: Size | None = Field(None, description="largest force, N")
    point: Vector | None = Field(
        None,
        description="where the force acts, m, body coordinates, from the centre of gravity; "
        "default: there",
    )
    tilt: Annotated[Positive, AfterValidator(_check_tilt), OR_ANGLE_IN_DEGREES] = required(
        "ρ, rad, below π/2, or {deg: ...}: the tilt stays below it"
    )

    @field_validator("point")
    @classmethod
    def _check_point(cls, point: tuple[float, ...] | None, info: ValidationInfo) -> object:
        if point is None:
            return point
        if info.data.get("force", 1.0) is None:
            raise value_error("has no force that acts there", "expected force beside it")
        if max(map(abs, point)) > MOST:
            raise value_error("is too far away", f"expected at most {MOST:g} m")
        return point

    @field_validator("tilt")
    @classmethod
    def _check_loads(cls, tilt: float, info: ValidationInfo) -> float:
        if info.data.get("couple", 1.0) is None and info.data.get("force", 1.0) is None:
            raise value_error("is that of no disturbance", "expected couple or force beside it")
        return tilt
