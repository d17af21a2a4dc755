"""The section of the attitude at which the body is wanted to rest; only answers depend on it."""

import math
from typing import Annotated

from pydantic import Field

from rbstab.config.quantities import Orientation, Positive
from rbstab.config.section import OR_DEGREES_IN_RANGE, OR_ONE_ANGLE, Section
from rbstab.config.sections.body import zero_vector


class Desired(Section):
    """The desired attitude, and the largest tilt with which a body rests there."""

    orientation: Annotated[Orientation, OR_DEGREES_IN_RANGE] = zero_vector(
        "Θ, rad, or {deg: [...]}"
    )
    within: Annotated[Positive, Field(le=math.pi), OR_ONE_ANGLE] = Field(
        math.radians(10.0), description="largest tilt, rad, or {deg: ...}"
    )
