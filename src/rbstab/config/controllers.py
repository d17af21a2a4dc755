"""The controllers of the config schema, one model for each variant.

The fields of their gains follow from the declarations of the elements
(`rbstab.elements.registry`).
"""

from typing import Annotated, Any, Literal

from pydantic import Field, ValidationInfo, create_model, field_validator

from rbstab.config.quantities import (
    Count,
    Diagonal,
    Direction,
    NotNegative,
    Positive,
    PositiveDefinite,
    PositiveSemidefinite,
    Real,
    Symmetric,
    Vector,
    Whole,
    components,
    is_regular,
    value_error,
)
from rbstab.config.section import Section, required, word_or
from rbstab.config.sections.actuators import OF_CONNECTORS, OF_CONTROLLER
from rbstab.config.sections.angles import OR_ANGLE_IN_DEGREES
from rbstab.elements.declarations import Gain, OwnState
from rbstab.elements.element import Element
from rbstab.elements.registry import CONNECTORS, STABILIZERS
from rbstab.elements.user_code.declared import Declared

_GAIN_TYPES: dict[tuple[str, bool], Any] = {
    ("matrix", True): PositiveDefinite,
    ("matrix", False): Symmetric,
    ("diagonal", True): Diagonal,
    ("diagonal", False): Vector,
    ("number", True): Positive,
    ("number", False): Real,
    ("direction", True): Direction,
}
"""The type of a gain, by its shape and whether it must be positive."""


def gain_fields(*elements: type[Element] | Declared) -> dict[str, Any]:
    """Return the fields of the gains of elements, for a model."""
    return {gain.name: _gain_field(gain) for element in elements for gain in element.gains}


def initial_fields(element: type[Element] | Declared) -> dict[str, Any]:
    """Return the fields of the initial values of the own states of a named element."""
    return {state.initial_key: _initial_field(state) for state in element.states}


def _initial_field(state: OwnState) -> tuple[Any, Any]:
    """Return the type and the field of the initial value of an own state."""
    description = f"{state.symbol} at the start, {state.unit}"
    return components(state.size), Field(default=(0.0,) * state.size, description=description)


def _gain_field(gain: Gain) -> tuple[Any, Any]:
    """Return the type and the field of a gain."""
    description = f"{gain.description}, {gain.unit}"
    if gain.default is not None:
        if gain.shape == "matrix":
            return PositiveSemidefinite, Field((gain.default,) * 3, description=description)
        return NotNegative, Field(gain.default, description=description)
    kind = NotNegative if gain.or_zero else _GAIN_TYPES[gain.shape, gain.positive]
    if gain.at_most is not None:
        kind = Annotated[NotNegative, Field(le=gain.at_most)]
    if gain.below is not None:
        kind = Annotated[kind, Field(lt=gain.below)]
    if gain.unit == "rad" and gain.shape == "number":
        kind = Annotated[kind, OR_ANGLE_IN_DEGREES]
    return kind, required(description)


def model_name(variant: str, kind: str) -> str:
    """Return the name of a model of a variant, such as `ViscoElasticController`."""
    return f"{variant.title().replace('-', '')}{kind}"


Anchor = Annotated[
    Literal["origin", "equilibrium"],
    Field(description="where E = 0: at X = 0, or at the rest position X_e under load"),
]


def _controller(variant: str, documentation: str, base: Any, **fields: Any) -> Any:
    """Return the model of a variant's controller."""
    name = model_name(variant, "Controller")
    all_fields: dict[str, Any] = {"variant": (Literal[variant], ...), **fields}
    return create_model(name, __base__=base, __doc__=documentation, **all_fields)


NoController = _controller(
    "none", "Only gravity and the elements of the config act on the body.", Section
)

FreeController = _controller(
    "free",
    "Only the two stabilizers act on the body (eq. 23, 24).",
    Section,
    **gain_fields(*STABILIZERS),
    **OF_CONTROLLER,
)


class AnchoredController(FreeController):  # type: ignore[misc, valid-type]  # built at run time
    """The contact point has an anchor."""

    anchor: Anchor = "origin"

    @field_validator("anchor")
    @classmethod
    def _check_anchor(cls, anchor: str, info: ValidationInfo) -> str:
        K_t = info.data.get("K_t")
        if anchor == "equilibrium" and K_t is not None and not is_regular(K_t):
            raise value_error(
                "is `equilibrium`, where K_t alone carries the weight, but K_t is singular",
                "expected origin, or a positive definite K_t",
            )
        limit = getattr(info.data.get("actuators"), "limit", None)
        if anchor == "equilibrium" and limit is not None and limit.H is not None:
            raise value_error(
                "is `equilibrium`, where K_t alone carries the weight, but H has a limit",
                "expected origin",
            )
        return anchor


PermanentController = _controller(
    "permanent", "The contact point is held fixed (eq. 11 to 21).", AnchoredController
)


def _connector_controller(variant: str) -> Any:
    """Return the model of a variant with a connector."""
    connector = CONNECTORS[variant]
    documentation = f"A connector acts at the contact point: {(connector.__doc__ or '').strip()}"
    fields = gain_fields(connector) | OF_CONNECTORS.get(variant, {})
    return _controller(variant, documentation.splitlines()[0], AnchoredController, **fields)


class Slope(Section):
    """The surface s = F + κE."""

    slope: Positive = required("κ of s = F + κE, 1/s")


class BoundaryLayer(Section):
    """A boundary layer, in which a saturation replaces the sign function."""

    boundary_layer: Positive = required("half-width, in the unit of s")


class Implicit(Section):
    """Implicit steps replace exact switching; they damp the motion numerically."""

    implicit: Positive = required("step, s")


Surface = Annotated[
    Literal["position"] | Slope,
    word_or(("position",), (Slope, "κ")),
    Field(description="position (s = E) or {slope: κ}"),
]
"""The surface on which a sliding connector or tie slides."""


class SlidingController(_connector_controller("sliding")):  # type: ignore[misc]  # built at run time
    """A sliding-mode connector acts at the contact point (eq. 39)."""

    surface: Surface
    law: Annotated[
        Literal["exact"] | BoundaryLayer | Implicit,
        word_or(("exact",), (BoundaryLayer, "width"), (Implicit, "step")),
        Field(description="exact, {boundary_layer: width} or {implicit: step}"),
    ] = "exact"
    stick_energy: Annotated[float, Field(ge=0, allow_inf_nan=False)] = Field(
        0.0,
        description="J; an axis may stick when its chatter energy is below; only for surface: "
        "position, law: exact",
    )
    switch_limit: Count = 10_000_000
    stored_switches: Whole = Field(
        100_000, ge=0, description="number of switches stored with time and axis"
    )

    @field_validator("law")
    @classmethod
    def _check_law(cls, law: Any, info: ValidationInfo) -> Any:
        if isinstance(law, Implicit) and info.data.get("actuators"):
            raise value_error(
                "has implicit steps beside actuators", "expected exact or {boundary_layer: width}"
            )
        return law

    @field_validator("stick_energy")
    @classmethod
    def _check_stick_energy(cls, energy: float, info: ValidationInfo) -> float:
        surface, law = info.data.get("surface"), info.data.get("law")
        if energy > 0 and isinstance(surface, Slope):
            raise value_error("has no effect on a slope surface", "expected surface: position")
        if energy > 0 and isinstance(law, Section):
            raise value_error("has no effect on this law", "expected law: exact")
        return energy


CONTROLLERS: dict[str, Any] = {
    "free": FreeController,
    "permanent": PermanentController,
    **{variant: _connector_controller(variant) for variant in CONNECTORS if variant != "sliding"},
    "sliding": SlidingController,
}
"""The controller model of each variant."""
