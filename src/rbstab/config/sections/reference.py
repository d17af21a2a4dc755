"""The section of printed values that reports compare with a run."""

from pydantic import Field

from rbstab.config.quantities import LongText, Text, Vector
from rbstab.config.section import Section


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
