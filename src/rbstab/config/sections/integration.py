"""The section of the integration; held bodies and sliding connectors have settings of their own."""

from typing import Annotated, Any, Literal

from pydantic import Field, ValidationInfo, field_validator

from rbstab.config.quantities import Count, Positive, Whole, value_error
from rbstab.config.section import Section, required, word_or


class Baumgarte(Section):
    """Baumgarte stabilization against drift."""

    baumgarte: Positive = required("decay rate of the drift, 1/s")


Method = Literal["DOP853", "RK45", "LSODA", "Radau"]

MIN_SCIPY_RTOL = 2.3e-14
"""The smallest rtol for SciPy. If rtol is too small, SciPy increases it and only warns."""

COORDINATES = "default: quaternion where no element reads Euler angles, else this one"

MIN_INTERVAL = 1e-100
"""Smallest time between samples, s: far below physical times, far above float underflow."""


class Integration(Section):
    """Settings of the integration."""

    duration: Positive = required("simulated time, s")
    samples: Whole = Field(401, ge=2, le=1_000_000, description="equally spaced, both ends")
    coordinates: Literal["Z", "W", "quaternion"] = Field("Z", description=COORDINATES)
    engine: Literal["scipy", "heyoka"] = "scipy"
    method: Method = Field("DOP853", description="scipy only")
    rtol: Annotated[Positive, Field(ge=1e-16, le=0.1)] = 1e-12
    atol: Annotated[Positive, Field(le=1.0)] = Field(1e-12, description="scipy only")
    range_bound: Annotated[Positive, Field(lt=1)] = Field(
        1e-3, description="the run stops when cos θ2 falls to this value (eq. 5)"
    )
    step_limit: Count = 1_000_000
    time_limit: Positive = Field(600.0, description="wall time of the run, without compiling, s")

    @field_validator("samples")
    @classmethod
    def _check_spacing(cls, samples: int, info: ValidationInfo) -> int:
        duration = info.data.get("duration")
        if duration is not None and duration / (samples - 1) < MIN_INTERVAL:
            raise value_error(
                f"{samples} samples in {duration:g} s are too close",
                f"expected at least {MIN_INTERVAL:g} s between samples",
            )
        return samples

    @field_validator("rtol")
    @classmethod
    def _check_rtol(cls, rtol: float, info: ValidationInfo) -> float:
        if info.data.get("engine") == "scipy" and rtol < MIN_SCIPY_RTOL:
            raise value_error(
                f"{rtol:g} is too small for the engine scipy",
                f"expected at least {MIN_SCIPY_RTOL:g}",
            )
        return rtol


class HeldIntegration(Integration):
    """Settings of the integration of a held body."""

    coordinates: Literal["reduced", "manifold", "quaternion"] = Field(  # type: ignore[assignment]
        "reduced", description=COORDINATES
    )
    drift_control: Annotated[
        Literal["none", "projection"] | Baumgarte,
        word_or(("none", "projection"), (Baumgarte, "rate")),
        Field(description="manifold only: none, projection or {baumgarte: rate}"),
    ] = "none"

    @field_validator("drift_control")
    @classmethod
    def _check_drift_control(cls, control: Any, info: ValidationInfo) -> Any:
        coordinates = info.data.get("coordinates")
        if control != "none" and coordinates in {"reduced", "quaternion"}:
            raise value_error(
                f"has no effect in {coordinates} coordinates",
                "expected coordinates: manifold",
            )
        if control == "projection" and _uses_lsoda(info.data):
            raise value_error(
                "cannot be combined with LSODA, which would lose its history at every step",
                "expected another method",
            )
        return control


def _uses_lsoda(integration: dict[str, Any]) -> bool:
    return integration.get("engine") == "scipy" and integration.get("method") == "LSODA"


class SlidingIntegration(Integration):
    """Settings of the integration with a sliding connector."""

    coordinates: Literal["W"] = "W"
    method: Literal["DOP853"] = Field("DOP853", description="scipy only")
    step_limit: Count = 100_000_000
