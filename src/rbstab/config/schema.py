"""The config schema, versions 1 and 2, with one model for each variant of the controller.

Version 2 adds `elements`; with them, the controller may be left out. The other sections are in
`config/sections`; the checks here compare sections with each other.
"""

from collections.abc import Mapping
from functools import reduce
from operator import or_
from typing import Annotated, Any, Literal, Self

from pydantic import Field, ValidationInfo, create_model, field_validator

from rbstab.config.controllers import CONTROLLERS, Implicit, NoController, Slope, model_name
from rbstab.config.elements import (
    Elements,
    check_sliding_points,
    followed_by_modes,
    inputs,
    reading_angles,
    sliding_ties,
    stops,
    switching,
)
from rbstab.config.quantities import Text, Vector, components, value_error, version
from rbstab.config.section import FrozenMapping, Section
from rbstab.config.sections.body import (
    BodySection,
    Desired,
    FreeInitial,
    HeldInitial,
    Reference,
    zero_vector,
)
from rbstab.config.sections.bound import BoundSection
from rbstab.config.sections.integration import HeldIntegration, Integration, SlidingIntegration
from rbstab.config.sections.signals import MAX_KNOTS
from rbstab.config.user_code.section import ALLOW
from rbstab.elements.element import Element
from rbstab.elements.motors import Hard
from rbstab.elements.registry import CONNECTORS, connector_of, stabilizers_of
from rbstab.files.text import line
from rbstab.mechanics.states import PITCH

SCHEMA_VERSIONS = (1, 2)
"""The versions that this program reads."""


SchemaVersion = Annotated[Literal[1, 2], version(*SCHEMA_VERSIONS)]


class Experiment(Section):
    """One experiment, with the sections that all variants have."""

    schema_version: SchemaVersion = 1
    title: Text = "untitled"
    body: BodySection
    gravity: Vector = zero_vector("m/s^2, inertial")
    controller: Any
    elements: Elements = Field(default_factory=FrozenMapping)
    initial: Any = Field(default_factory=HeldInitial)
    integration: Any
    desired: Desired | None = None
    bound: BoundSection | None = None
    reference: Reference | None = None

    def __repr__(self) -> str:
        """Return one line: title, variant, named elements, duration, engine."""
        named = [f"elements {', '.join(self.elements)}"] if self.elements else []
        duration = f"{self.integration.duration:g} s"
        facts = (self.controller.variant, *named, duration, f"engine {self.integration.engine}")
        return line("Config", self.title, facts)

    __str__ = __repr__

    def plain(self) -> dict[str, Any]:
        """Return the config as plain data with all defaults. It loads as the same config.

        Quaternions are left out: they are the default wherever they are possible, and so a change
        of these data may add what reads Euler angles.
        """
        data = self.model_dump(mode="json", exclude_none=True, by_alias=True)
        if self.integration.coordinates == "quaternion":
            del data["integration"]["coordinates"]
        if self.schema_version == 1:
            # Version 1 has no such key.
            del data["elements"]
        return data

    def in_angles(self) -> Self:
        """Return the config in Euler angles, if it is in quaternions."""
        if self.integration.coordinates != "quaternion":
            return self
        usual = type(self.integration).model_fields["coordinates"].default
        integration = self.integration.model_copy(update={"coordinates": usual})
        return self.model_copy(update={"integration": integration})

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle plain data, and whether the code of users may run."""
        allowed = any(getattr(element, "may_run", False) for element in self.elements.values())
        return _unpickled, (self.controller.variant, self.plain(), allowed)

    @field_validator("controller")
    @classmethod
    def _check_controller(cls, controller: Any, info: ValidationInfo) -> Any:
        if controller.variant == NO_VARIANT and info.data.get("schema_version") == 1:
            raise value_error("has the variant none", "expected schema_version: 2 beside it")
        return controller

    @field_validator("elements")
    @classmethod
    def _check_elements(cls, elements: Any, info: ValidationInfo) -> Any:
        if info.data.get("schema_version") == 1:
            raise value_error("is not a key of schema version 1", "expected schema_version: 2")
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
        names = stops(elements)
        if is_sliding and controller.stick_energy and names:
            raise value_error(
                f"has {', '.join(names)} beside a sliding connector with a stick_energy: "
                "each impact would throw the axes off that stick",
                "expected stick_energy: 0, or no stops",
            )
        if len(names) > 1:
            raise value_error(
                f"has several stops: {', '.join(names)}",
                "expected one: the body would never reach the others",
            )
        for name in names:
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
    def _check_integration(cls, integration: Any, info: ValidationInfo) -> Any:
        controller, elements = info.data.get("controller"), info.data.get("elements") or {}
        switches, legs = switching(elements), inputs(elements, with_legs=True)
        if any(kind.mode_count for kind in stabilizers_of(controller)):
            switches.append("controller.actuators")
        connector = connector_of(controller)
        if issubclass(connector or Element, Hard):
            switches.append("controller.connector_actuators")
        interrupted = [*switches, *(name for name in legs if name not in switches)]
        if interrupted and integration.engine == "scipy" and integration.method == "LSODA":
            raise value_error(
                f"has method: LSODA, which loses its history at each switch or leg of "
                f"{', '.join(interrupted)}",
                "expected another method",
            )
        if switches and getattr(integration, "drift_control", "none") == "projection":
            raise value_error(
                "has drift_control: projection, which moves the state past switches of "
                f"{', '.join(switches)}",
                "expected none or {baumgarte: rate}",
            )
        reading = reading_angles(controller, elements)
        if reading and integration.coordinates == "quaternion":
            raise value_error(
                f"has coordinates: quaternion, but {', '.join(reading)} may read Euler angles",
                "expected other coordinates, or elements that do not: no K_r, guards or Python",
            )
        is_free = not reading and not isinstance(integration, SlidingIntegration)
        if is_free and "coordinates" not in integration.model_fields_set:
            # No element reads Θ, so nothing is singular at θ2 = ±π/2, and no run leaves the range.
            integration = integration.model_copy(update={"coordinates": "quaternion"})
        for name in legs:
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


def _initial(variant: str) -> type[Section]:
    """Return the model of a variant's initial state, with the own states of its connector."""
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
    initial, is_none = _initial(variant), variant == NO_VARIANT
    return create_model(
        model_name(variant, "Experiment"),
        __base__=Experiment,
        __doc__=_DOCUMENTATION.get(variant, f"A body with the connector {variant}."),
        controller=(CONTROLLERS.get(variant, NoController), NO_CONTROLLER if is_none else ...),
        initial=(initial, initial()),
        integration=(_INTEGRATIONS.get(variant, Integration), ...),
    )


VARIANTS = tuple(CONTROLLERS)
"""The variants of the controller."""

_MODELS: dict[str, type[Experiment]] = {}


def model_of(variant: str) -> type[Experiment]:
    """Return the config model of a variant, or of a config without a controller.

    It is made when it is first used, because a run needs one of them.
    """
    if variant not in _MODELS:
        # All threads get the same model, or equal configs would differ.
        _MODELS.setdefault(variant, _experiment(variant))
    return _MODELS[variant]


def _unpickled(variant: str, data: dict[str, Any], allowed: bool) -> Experiment:
    return model_of(variant).model_validate(data, context={ALLOW: allowed})


def variant_of(data: Mapping[str, Any]) -> Any:
    """Return the variant that the data of a config state: none without a controller."""
    if "controller" not in data and data.get("schema_version") == 2:
        return NO_VARIANT
    controller = data.get("controller")
    return controller.get("variant") if isinstance(controller, dict) else None


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

    variants = (*VARIANTS, NO_VARIANT)
    schema = TypeAdapter(reduce(or_, map(model_of, variants))).json_schema()
    for variant in variants:
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
