"""The config schema, version 1: one model for each variant of the controller."""

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, ValidationInfo, field_validator
from pydantic_core import PydanticCustomError

from rbstab.config.controllers import (
    EmbeddedController,
    FreeController,
    PermanentController,
    SlidingController,
    ViscoElasticController,
)
from rbstab.config.quantities import (
    Count,
    LongText,
    Orientation,
    Positive,
    PositiveDefinite,
    Text,
    Vector,
    complaint,
)
from rbstab.config.section import Section, required, word_or_section

SCHEMA_VERSION = 1

ZERO = (0.0, 0.0, 0.0)


def _zero(unit: str) -> Any:
    return Field(default=ZERO, description=unit)


class BodySection(Section):
    """The rigid body."""

    mass: Positive = required("m, kg")
    inertia: PositiveDefinite = required("J, kg m^2, body coordinates: principal moments or matrix")
    contact_point: Vector = required("R, m, body coordinates, from the centre of gravity to C")


class HeldInitial(Section):
    """Initial state of the held body; X and V follow (eq. 32)."""

    orientation: Orientation = _zero("Θ, rad")
    angular_velocity: Vector = _zero("Ω, rad/s, body")


class FreeInitial(HeldInitial):
    """Initial state of the body that is not held."""

    position: Vector = _zero("X, m, inertial")
    velocity: Vector = _zero("V, m/s, inertial")


class EmbeddedInitial(FreeInitial):
    """Initial state of the body and of the connector."""

    connector_state: Vector = _zero("D, m, inertial")


class Baumgarte(Section):
    """Drift control by Baumgarte's stabilization."""

    baumgarte: Positive = required("rate at which drift dies out, 1/s")


Method = Literal["DOP853", "RK45", "LSODA", "Radau"]

MIN_SCIPY_RTOL = 2.3e-14
"""SciPy replaces a smaller one by 100 times round-off, with a warning only."""


MIN_INTERVAL = 1e-100
"""s: far below all physics, far above where floating point numbers run out."""


class Integration(Section):
    """How the motion is followed."""

    duration: Positive = required("s")
    samples: int = Field(401, ge=2, le=1_000_000, description="equally spaced, both ends")
    coordinates: Literal["Z", "W"] = "Z"
    engine: Literal["scipy", "heyoka"] = "scipy"
    method: Method = Field("DOP853", description="scipy only")
    rtol: Annotated[Positive, Field(ge=1e-16, le=0.1)] = 1e-12
    atol: Annotated[Positive, Field(le=1.0)] = Field(1e-12, description="scipy only")
    range_bound: Annotated[Positive, Field(lt=1)] = Field(
        1e-3, description="the run stops where cos θ2 falls to this (eq. 5)"
    )
    step_limit: Count = 1_000_000
    time_limit: Positive = Field(600.0, description="wall time of the integration, s")

    @field_validator("samples")
    @classmethod
    def _apart(cls, samples: int, info: ValidationInfo) -> int:
        duration = info.data.get("duration")
        if duration is not None and duration / (samples - 1) < MIN_INTERVAL:
            raise complaint(
                f"{samples} samples in {duration:g} s cannot be told apart",
                f"expected them at least {MIN_INTERVAL:g} s apart",
            )
        return samples

    @field_validator("rtol")
    @classmethod
    def _within_reach(cls, rtol: float, info: ValidationInfo) -> float:
        if info.data.get("engine") == "scipy" and rtol < MIN_SCIPY_RTOL:
            raise complaint(
                f"{rtol:g} is below what the engine scipy can do",
                f"expected at least {MIN_SCIPY_RTOL:g}",
            )
        return rtol


class HeldIntegration(Integration):
    """How the motion of the held body is followed."""

    coordinates: Literal["reduced", "manifold"] = "reduced"  # type: ignore[assignment]
    drift_control: Annotated[
        Literal["none", "projection"] | Baumgarte,
        Field(description="manifold only: none, projection or {baumgarte: rate}"),
    ] = "none"

    @field_validator("drift_control", mode="wrap")
    @classmethod
    def _possible(cls, value: Any, _handler: Any, info: ValidationInfo) -> Any:
        control = word_or_section(value, ("none", "projection"), (Baumgarte, "rate"))
        if control != "none" and info.data.get("coordinates") == "reduced":
            raise complaint(
                "has nothing to control in reduced coordinates", "expected coordinates: manifold"
            )
        if control == "projection" and _uses_lsoda(info.data):
            raise complaint(
                "cannot be combined with LSODA, which would lose its history at every step",
                "expected another method",
            )
        return control


def _uses_lsoda(integration: dict[str, Any]) -> bool:
    return integration.get("engine") == "scipy" and integration.get("method") == "LSODA"


class SlidingIntegration(Integration):
    """How the motion under a sliding connector is followed."""

    coordinates: Literal["W"] = "W"
    method: Literal["DOP853"] = Field("DOP853", description="scipy only")
    step_limit: Count = 100_000_000


class FinalState(Section):
    """Printed final values."""

    orientation: Vector | None = None
    angular_velocity: Vector | None = None
    position: Vector | None = None
    velocity: Vector | None = None


class Reference(Section):
    """Printed values that reports set beside the run."""

    source: Text
    note: LongText | None = None
    final: FinalState | None = None
    peak_contact_displacement: Vector | None = Field(
        None, description="the value of E farthest from zero, by axis, m"
    )


def _whole(value: Any) -> Any:
    # True and 1.0 equal 1, and a literal would take them.
    if type(value) is not int:
        raise PydanticCustomError("literal_error", "no whole number", {"expected": "1"})
    return value


SchemaVersion = Annotated[Literal[1], BeforeValidator(_whole)]


class Experiment(Section):
    """One experiment: the parts that every variant has."""

    schema_version: SchemaVersion = 1
    title: Text = "untitled"
    body: BodySection
    gravity: Vector = _zero("m/s^2, inertial")
    controller: Any
    initial: Any = Field(default_factory=HeldInitial)
    integration: Any
    reference: Reference | None = None


class FreeExperiment(Experiment):
    """A body with its two stabilizers."""

    controller: FreeController
    initial: FreeInitial = FreeInitial()
    integration: Integration


class PermanentExperiment(Experiment):
    """A body held at its contact point."""

    controller: PermanentController
    initial: HeldInitial = HeldInitial()
    integration: HeldIntegration


class ViscoElasticExperiment(Experiment):
    """A body tied by a visco-elastic connector."""

    controller: ViscoElasticController
    initial: FreeInitial = FreeInitial()
    integration: Integration


class EmbeddedExperiment(Experiment):
    """A body tied by an embedded connector."""

    controller: EmbeddedController
    initial: EmbeddedInitial = EmbeddedInitial()
    integration: Integration


class SlidingExperiment(Experiment):
    """A body tied by a sliding-mode connector."""

    controller: SlidingController
    initial: FreeInitial = FreeInitial()
    integration: SlidingIntegration


VARIANTS: dict[str, type[Experiment]] = {
    "free": FreeExperiment,
    "permanent": PermanentExperiment,
    "visco-elastic": ViscoElasticExperiment,
    "embedded": EmbeddedExperiment,
    "sliding": SlidingExperiment,
}

Config = (
    FreeExperiment
    | PermanentExperiment
    | ViscoElasticExperiment
    | EmbeddedExperiment
    | SlidingExperiment
)


def json_schema() -> dict[str, Any]:
    """The JSON Schema of a config, for editors."""
    from pydantic import TypeAdapter

    schema = TypeAdapter(Config).json_schema()
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": f"rbstab config, schema version {SCHEMA_VERSION}",
        **schema,
    }
