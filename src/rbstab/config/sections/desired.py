"""The section of the attitude at which the body is wanted to rest; only answers depend on it."""

import math
from typing import Annotated

from pydantic import AfterValidator, Field

from rbstab.config.quantities import Positive, value_error
from rbstab.config.section import Section
from rbstab.config.sections.angles import OR_ANGLE_IN_DEGREES, Attitude
from rbstab.config.sections.body import zero_vector


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
