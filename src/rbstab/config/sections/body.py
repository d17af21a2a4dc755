"""The sections of the body, its initial state, the desired attitude, and printed values.

Only answers depend on the desired attitude. Reports compare the printed values with a run.
"""

import math
from typing import Annotated, Any

from pydantic import AfterValidator, ConfigDict, Field, ValidationInfo, field_validator

from rbstab.config.quantities import (
    ZERO,
    LongText,
    Positive,
    PositiveDefinite,
    Text,
    Vector,
    value_error,
)
from rbstab.config.section import Section, required
from rbstab.config.sections.angles import OR_ANGLE_IN_DEGREES, OR_DEGREES, Attitude


def zero_vector(description: str) -> Any:
    """Return a key of a section: a vector that is zero by default."""
    return Field(default=ZERO, description=description)


class BodySection(Section):
    """The rigid body."""

    mass: Positive = required("m, kg")
    inertia: PositiveDefinite = required("J, kg m^2, body coordinates: principal moments or matrix")
    contact_point: Vector = required("R, m, body coordinates, from the centre of gravity to C")


def _true_or_none(value: Any) -> Any:
    # Without the key nothing is attached, and configs from before there was the key have their ids.
    return value or None


def _always_true(value: Any) -> Any:
    if value is False:
        raise value_error(
            "is false for a body that is held at its contact point",
            "expected true, which is always so, or no such key",
        )
    # It has no effect, so it is not a part of the config, nor of its id.
    return None


class HeldInitial(Section):
    """Initial state of a body held at its contact point; X and V follow (eq. 32)."""

    attached: Annotated[bool, AfterValidator(_always_true)] = Field(  # type: ignore[assignment]
        default=None,
        description="a held contact point is always on its anchor: true changes nothing",
        json_schema_extra={"const": True, "default": True},
    )
    orientation: Attitude = zero_vector(
        "Θ, rad: turns about x, then the new y, then the new z; or {deg: [...]}, "
        "{quaternion: [w, x, y, z]} or {matrix: [[...], [...], [...]]}"
    )
    angular_velocity: Annotated[Vector, OR_DEGREES] = zero_vector("Ω, rad/s, body, or {deg: ...}")


_POSITION_OF_ATTACHED: dict[str, Any] = {
    "properties": {"attached": {"const": True}},
    "required": ["attached", "position"],
}
"""The JSON Schema of an initial state that is wrong, although each of its keys is right."""


class FreeInitial(HeldInitial):
    """Initial state of a body that is not held."""

    model_config = ConfigDict(json_schema_extra={"not": _POSITION_OF_ATTACHED})

    attached: Annotated[bool, AfterValidator(_true_or_none)] = Field(  # type: ignore[assignment]
        default=None,
        description="start with the contact point on its anchor, E = 0: X follows (eq. 32)",
        json_schema_extra={"default": False},
    )
    position: Vector = Field(
        default=ZERO, validate_default=True, description="X, m, inertial; not beside attached: true"
    )
    velocity: Vector = zero_vector("V, m/s, inertial")

    @field_validator("position", mode="wrap")
    @classmethod
    def _check_attached(cls, value: Any, handler: Any, info: ValidationInfo) -> Any:
        if not info.data.get("attached"):
            return handler(value)
        # A given value is a list, or a tuple that is another one than the default.
        if value is not ZERO:
            raise value_error(
                "is given beside attached: true, from which it follows",
                "expected one of the two",
            )
        return None


def _check_tilt(tilt: float) -> float:
    if tilt > math.pi:
        degrees = f"{math.degrees(tilt):.6g}"
        raise value_error(f"is {degrees}°", "expected at most 180°; degrees are {deg: 10}")
    return tilt


class Desired(Section):
    """The desired attitude, and the largest tilt with which a body rests there."""

    orientation: Attitude = zero_vector("Θ, rad, or {deg: [...]}")
    within: Annotated[Positive, AfterValidator(_check_tilt), OR_ANGLE_IN_DEGREES] = Field(
        math.radians(10.0), description="largest tilt, rad, or {deg: ...}"
    )


class FinalState(Section):
    """Final values printed in the source."""

    orientation: Vector | None = None
    angular_velocity: Vector | None = None
    position: Vector | None = None
    velocity: Vector | None = None


class Reference(Section):
    """Printed values that reports compare with the run."""

    source: Text
    note: LongText | None = None
    final: FinalState | None = None
    peak_contact_displacement: Vector | None = Field(
        None, description="the value of E farthest from zero, by axis, m"
    )
