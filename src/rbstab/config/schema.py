"""The config schema, versions 1 and 2, with one model for each variant of the controller.

Version 2 adds `elements`; with them, the controller may be left out.
"""

from collections.abc import Iterator, Mapping
from functools import cache, reduce
from operator import or_
from threading import RLock
from typing import Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationInfo,
    create_model,
    field_validator,
)
from pydantic_core import PydanticCustomError

from rbstab.config.controllers import CONTROLLERS, Implicit, NoController, Slope, model_name
from rbstab.config.elements import (
    Elements,
    check_sliding_points,
    followed_by_modes,
    inputs,
    sliding_ties,
    stops,
    switching,
)
from rbstab.config.inputs.signals import MAX_KNOTS
from rbstab.config.quantities import (
    Count,
    LongText,
    Orientation,
    Positive,
    PositiveDefinite,
    Text,
    Vector,
    components,
    value_error,
)
from rbstab.config.section import OR_DEGREES, FrozenMapping, Section, required, word_or_section
from rbstab.elements.registry import CONNECTORS
from rbstab.mechanics.states import PITCH

SCHEMA_VERSIONS = (1, 2)
"""The versions that this program reads."""

ZERO = (0.0, 0.0, 0.0)


def _zero_vector(description: str) -> Any:
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
    orientation: Annotated[Orientation, OR_DEGREES] = _zero_vector("Θ, rad, or {deg: [...]}")
    angular_velocity: Annotated[Vector, OR_DEGREES] = _zero_vector("Ω, rad/s, body, or {deg: ...}")


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
    velocity: Vector = _zero_vector("V, m/s, inertial")

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


class Baumgarte(Section):
    """Baumgarte stabilization against drift."""

    baumgarte: Positive = required("decay rate of the drift, 1/s")


Method = Literal["DOP853", "RK45", "LSODA", "Radau"]

MIN_SCIPY_RTOL = 2.3e-14
"""The smallest rtol for SciPy. If rtol is too small, SciPy increases it and only warns."""


MIN_INTERVAL = 1e-100
"""Smallest time between samples, s: far below physical times, far above float underflow."""


class Integration(Section):
    """Settings of the integration."""

    duration: Positive = required("s")
    samples: int = Field(401, ge=2, le=1_000_000, description="equally spaced, both ends")
    coordinates: Literal["Z", "W"] = "Z"
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

    coordinates: Literal["reduced", "manifold"] = "reduced"  # type: ignore[assignment]
    drift_control: Annotated[
        Literal["none", "projection"] | Baumgarte,
        Field(description="manifold only: none, projection or {baumgarte: rate}"),
    ] = "none"

    @field_validator("drift_control", mode="wrap")
    @classmethod
    def _check_drift_control(cls, value: Any, _handler: Any, info: ValidationInfo) -> Any:
        control = word_or_section(value, ("none", "projection"), (Baumgarte, "rate"))
        if control != "none" and info.data.get("coordinates") == "reduced":
            raise value_error(
                "has no effect in reduced coordinates",
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


def _check_whole(value: Any) -> Any:
    # True and 1.0 equal 1, so a literal would accept them.
    if type(value) is not int:
        raise PydanticCustomError("literal_error", "not a whole number", {"expected": "1 or 2"})
    return value


SchemaVersion = Annotated[Literal[1, 2], BeforeValidator(_check_whole)]


class Experiment(Section):
    """One experiment, with the sections that all variants have."""

    schema_version: SchemaVersion = 1
    title: Text = "untitled"
    body: BodySection
    gravity: Vector = _zero_vector("m/s^2, inertial")
    controller: Any
    elements: Elements = Field(default_factory=FrozenMapping)
    initial: Any = Field(default_factory=HeldInitial)
    integration: Any
    reference: Reference | None = None

    @field_validator("elements")
    @classmethod
    def _check_version(cls, elements: Any, info: ValidationInfo) -> Any:
        if info.data.get("schema_version") == 1:
            raise value_error("is not a key of schema version 1", "expected schema_version: 2")
        return elements

    @field_validator("controller")
    @classmethod
    def _check_controller(cls, controller: Any, info: ValidationInfo) -> Any:
        if controller.variant == NO_VARIANT and info.data.get("schema_version") == 1:
            raise value_error("has the variant none", "expected schema_version: 2 beside it")
        return controller

    @field_validator("elements")
    @classmethod
    def _check_sliding(cls, elements: Any, info: ValidationInfo) -> Any:
        controller: Any = info.data.get("controller")
        is_sliding = controller is not None and controller.variant == "sliding"
        beside = followed_by_modes(elements)
        if is_sliding and beside and isinstance(controller.law, Implicit):
            raise value_error(
                f"has {', '.join(beside)} beside a sliding connector with implicit steps",
                "expected law: exact or {boundary_layer: width}, or elements that do not switch, "
                "supply power, or have states",
            )
        sliding = {name: elements[name].point for name in sliding_ties(elements)}
        body = info.data.get("body")
        on_slope = is_sliding and isinstance(controller.surface, Slope)
        if on_slope and body is not None and controller.law == "exact":
            sliding["connector"] = body.contact_point
        check_sliding_points(sliding)
        if is_sliding and controller.stick_energy and stops(elements):
            raise value_error(
                f"has {', '.join(stops(elements))} beside a sliding connector with a stick_energy: "
                "each impact would throw the axes off that stick",
                "expected stick_energy: 0, or no stops",
            )
        return elements

    @field_validator("elements")
    @classmethod
    def _check_stops(cls, elements: Any) -> Any:
        if len(stops(elements)) > 1:
            raise value_error(
                f"has several stops: {', '.join(stops(elements))}",
                "expected one: the body would never reach the others",
            )
        for name in stops(elements):
            angle = elements[name].angle
            beyond = [n for n, soft in elements.items() if getattr(soft, "soft_angle", 0) >= angle]
            if beyond:
                raise value_error(
                    f"has a soft_angle that is not inside the stop {name}: {', '.join(beyond)}",
                    f"expected less than {angle:g}",
                )
        return elements

    @field_validator("initial")
    @classmethod
    def _check_start(cls, initial: Any, info: ValidationInfo) -> Any:
        elements, pitch = info.data.get("elements") or {}, abs(initial.orientation[PITCH])
        for name in stops(elements):
            if pitch > elements[name].angle:
                raise value_error(
                    f"has |θ2| = {pitch:g} rad, beyond the stop {name}",
                    f"expected orientation[{PITCH}] between ±{elements[name].angle:g}",
                )
        return initial

    @field_validator("integration")
    @classmethod
    def _check_switching(cls, integration: Any, info: ValidationInfo) -> Any:
        names = ", ".join(switching(info.data.get("elements") or {}))
        if names and integration.engine == "scipy" and integration.method == "LSODA":
            raise value_error(
                f"has method: LSODA, which loses its history at each switch of {names}",
                "expected another method",
            )
        if names and getattr(integration, "drift_control", "none") == "projection":
            raise value_error(
                f"has drift_control: projection, which moves the state past switches of {names}",
                "expected none or {baumgarte: rate}",
            )
        return integration

    @field_validator("integration")
    @classmethod
    def _check_inputs(cls, integration: Any, info: ValidationInfo) -> Any:
        elements = info.data.get("elements") or {}
        names = inputs(elements, with_legs=True)
        if names and integration.engine == "scipy" and integration.method == "LSODA":
            raise value_error(
                f"has method: LSODA, which loses its history at each leg of {', '.join(names)}",
                "expected another method",
            )
        for name in names:
            signal = elements[name].signal
            knots = signal.rate * integration.duration if signal.kind == "noise" else 0.0
            if knots > MAX_KNOTS:
                raise value_error(
                    f"has duration: {integration.duration:g}, for which the noise of {name} needs "
                    f"{knots:.3g} values",
                    f"expected a duration, or a rate of the noise, with at most {MAX_KNOTS} values",
                )
        return integration


_DOCUMENTATION = {
    "none": "A body without a controller.",
    "free": "A body with its two stabilizers.",
    "permanent": "A body held at its contact point.",
}


NO_VARIANT = "none"
"""The variant of a config without a controller."""

NO_CONTROLLER = NoController(variant=NO_VARIANT)

_MAKING = RLock()
"""Held while a model is made: all threads must get the same one, or pickle refuses the other."""


def _initial(variant: str) -> type[Section]:
    """Return the model of a variant's initial state, with the own states of its connector."""
    with _MAKING:
        return _made_initial(variant)


@cache
def _made_initial(variant: str) -> type[Section]:
    if variant == "permanent":
        return HeldInitial
    states = CONNECTORS[variant].states if variant in CONNECTORS else ()
    if not states:
        return FreeInitial
    fields: dict[str, Any] = {}
    for state in states:
        description = f"{state.symbol}, {state.unit}: {state.description}"
        default = Field(default=(0.0,) * state.size, description=description)
        fields[state.name] = components(state.size), default
    documentation = "Initial state of the body and of the connector."
    name = model_name(variant, "Initial")
    return create_model(name, __base__=FreeInitial, __doc__=documentation, **fields)


_INTEGRATIONS: dict[str, type[Integration]] = {
    "permanent": HeldIntegration,
    "sliding": SlidingIntegration,
}
"""The models of variants with special settings of the integration."""


def _experiment(variant: str) -> type[Experiment]:
    """Return the model of a variant's config."""
    with _MAKING:
        return _made_experiment(variant)


@cache
def _made_experiment(variant: str) -> type[Experiment]:
    initial, is_none = _initial(variant), variant == NO_VARIANT
    return create_model(
        model_name(variant, "Experiment"),
        __base__=Experiment,
        __doc__=_DOCUMENTATION.get(variant, f"A body with the connector {variant}."),
        controller=(CONTROLLERS.get(variant, NoController), NO_CONTROLLER if is_none else ...),
        initial=(initial, initial()),
        integration=(_INTEGRATIONS.get(variant, Integration), ...),
    )


class _Variants(Mapping[str, type[Experiment]]):
    """The models by variant, each one made when it is first used: a run needs one of them."""

    def __getitem__(self, variant: str) -> type[Experiment]:
        if variant not in CONTROLLERS:
            raise KeyError(variant)
        return _experiment(variant)

    def __iter__(self) -> Iterator[str]:
        return iter(CONTROLLERS)

    def __len__(self) -> int:
        return len(CONTROLLERS)

    def __contains__(self, variant: object) -> bool:
        return variant in CONTROLLERS


VARIANTS = _Variants()
"""The config model of each variant of the controller."""


def model_of(variant: str) -> type[Experiment]:
    """Return the config model of a variant, or of a config without a controller."""
    return _experiment(variant) if variant == NO_VARIANT else VARIANTS[variant]


def variant_of(data: Mapping[str, Any]) -> Any:
    """Return the variant that the data of a config state: none without a controller."""
    if "controller" not in data and data.get("schema_version") == 2:
        return NO_VARIANT
    controller = data.get("controller")
    return controller.get("variant") if isinstance(controller, dict) else None


def __getattr__(name: str) -> Any:
    # Pickle finds a model by its name in this module.
    for variant in (*CONTROLLERS, NO_VARIANT):
        for kind, model in (("Experiment", _experiment), ("Initial", _initial)):
            if name == model_name(variant, kind):
                return model(variant)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


Config = Experiment
"""A config of any variant."""


_SECOND_VERSION = {
    "properties": {"schema_version": {"const": 2}},
    "required": ["schema_version"],
}
"""The JSON Schema of a config of version 2, for what version 1 does not have."""


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of configs, for editors."""
    from pydantic import TypeAdapter

    models = [*VARIANTS.values(), model_of(NO_VARIANT)]
    schema = TypeAdapter(reduce(or_, models)).json_schema()
    for variant in (*VARIANTS, NO_VARIANT):
        model = schema["$defs"][model_name(variant, "Experiment")]
        if variant == NO_VARIANT:
            model |= {"allOf": [_SECOND_VERSION]}
        else:
            model |= {"dependentSchemas": {"elements": _SECOND_VERSION}}
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": f"rbstab config, schema versions {' and '.join(map(str, SCHEMA_VERSIONS))}",
        **schema,
    }
