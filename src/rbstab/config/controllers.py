"""The controllers of the config schema: one for each variant."""

from typing import Annotated, Any, Literal

from pydantic import Field, ValidationInfo, field_validator

from rbstab.config.quantities import Count, Diagonal, Positive, PositiveDefinite, complaint
from rbstab.config.section import Section, required, word_or_section


class FreeController(Section):
    """The two stabilizers alone (eq. 23, 24)."""

    variant: Literal["free"]
    K_t: PositiveDefinite = required("translational stiffness, N/m, inertial")
    L_t: PositiveDefinite = required("translational damping, N s/m, inertial")
    K_r: PositiveDefinite = required("rotational stiffness, N m/rad, Euler angles")
    L_r: PositiveDefinite = required("rotational damping, N m s/rad, body")


Anchor = Annotated[
    Literal["origin", "equilibrium"],
    Field(description="where C belongs: E = 0 at X = 0, or at the loaded rest position X_e"),
]


class PermanentController(FreeController):
    """The contact point held fast (eq. 11 to 21)."""

    variant: Literal["permanent"]  # type: ignore[assignment]
    anchor: Anchor = "origin"


class ViscoElasticController(FreeController):
    """The contact point tied by a visco-elastic connector (eq. 40)."""

    variant: Literal["visco-elastic"]  # type: ignore[assignment]
    anchor: Anchor = "origin"
    K_c: PositiveDefinite = required("connector stiffness, N/m, inertial")
    L_c: PositiveDefinite = required("connector damping, N s/m, inertial")


class EmbeddedController(ViscoElasticController):
    """The contact point tied by a connector with own states (eq. 22)."""

    variant: Literal["embedded"]  # type: ignore[assignment]
    K_d: PositiveDefinite = required("stiffness of the connector's own state, N/m, inertial")
    L_d: PositiveDefinite = required("damping of the connector's own state, N s/m, inertial")


class Slope(Section):
    """The surface s = F + κE."""

    slope: Positive = required("κ of s = F + κE, 1/s")


class BoundaryLayer(Section):
    """A saturation in place of the sign."""

    boundary_layer: Positive = required("half-width, in the unit of s")


class Implicit(Section):
    """Implicit steps in place of exact switching, damped by the step."""

    implicit: Positive = required("step, s")


class SlidingController(FreeController):
    """The contact point tied by a sliding-mode connector (eq. 39)."""

    variant: Literal["sliding"]  # type: ignore[assignment]
    anchor: Anchor = "origin"
    K_s: Diagonal = required("force of each axis, N, inertial")
    surface: Annotated[
        Literal["position"] | Slope, Field(description="position (s = E) or {slope: κ}")
    ]
    law: Annotated[
        Literal["exact"] | BoundaryLayer | Implicit,
        Field(description="exact, {boundary_layer: width} or {implicit: step}"),
    ] = "exact"
    stick_energy: Annotated[float, Field(ge=0, allow_inf_nan=False)] = Field(
        0.0, description="J; surface position, law exact: axes may stick when the chatter is below"
    )
    switch_limit: Count = 10_000_000
    stored_switches: int = Field(100_000, ge=0, description="whose time and axis are stored")

    @field_validator("surface", mode="wrap")
    @classmethod
    def _surface(cls, value: Any, _handler: Any) -> Any:
        return word_or_section(value, ("position",), (Slope, "κ"))

    @field_validator("law", mode="wrap")
    @classmethod
    def _law(cls, value: Any, _handler: Any) -> Any:
        return word_or_section(value, ("exact",), (BoundaryLayer, "width"), (Implicit, "step"))

    @field_validator("stick_energy")
    @classmethod
    def _of_effect(cls, energy: float, info: ValidationInfo) -> float:
        surface, law = info.data.get("surface"), info.data.get("law")
        if energy > 0 and isinstance(surface, Slope):
            raise complaint("has no effect on a slope, which slides", "expected surface: position")
        if energy > 0 and isinstance(law, Section):
            raise complaint("has no effect on this law", "expected law: exact")
        return energy
