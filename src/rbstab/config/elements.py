"""The elements of the config schema: any number of them, each with a name and a kind.

The fields of a kind follow from the declarations of its element (`rbstab.elements.registry.KINDS`).
"""

import re
from collections.abc import Mapping
from functools import reduce
from operator import or_
from typing import Annotated, Any, Literal, get_args

from pydantic import (
    AfterValidator,
    BeforeValidator,
    Field,
    ValidationInfo,
    WrapValidator,
    create_model,
    field_validator,
)

from rbstab.config.controllers import BoundaryLayer, Slope, gain_fields, initial_fields
from rbstab.config.errors import hint
from rbstab.config.inputs.signals import SMOOTH_SIGNALS, Signal, signal_model
from rbstab.config.quantities import value_error
from rbstab.config.section import FrozenMapping, Section, required, word_or_section
from rbstab.config.source import Path
from rbstab.config.units import Kind
from rbstab.config.user_code.section import KIND as PYTHON
from rbstab.config.user_code.section import PARAMETERS, PythonElement, parameters_in
from rbstab.elements.declarations import Gain, OwnState
from rbstab.elements.element import Element
from rbstab.elements.inputs.loads import Input
from rbstab.elements.registry import KINDS, SELECTORS, element_of, selected
from rbstab.elements.user_code.declared import Declared

MAX_ELEMENTS = 100

SIGNAL = "signal"
"""The key of the signal of an input."""

RESERVED_NAMES = ("anchor", "body", "connector", "gravity", "kinetic")
"""Names that parts of every system have."""

_NAME = re.compile(r"[a-z][a-z0-9_]{0,39}")


_MEANINGS = {
    "method": "how the range is guarded",
    "quantity": "what acts: a force or a couple, fixed in space or in the body",
}
"""The meaning of each selector."""


class SlidingKeys(Section):
    """The keys of a sliding tie besides its gains."""

    kind: Literal["sliding"] = required("the kind of element")
    surface: Annotated[
        Literal["position"] | Slope, Field(description="position (s = E) or {slope: κ}")
    ]
    law: Annotated[
        Literal["exact"] | BoundaryLayer,
        Field(description="exact or {boundary_layer: width}"),
    ] = "exact"

    @field_validator("surface", mode="wrap")
    @classmethod
    def _check_surface(cls, value: Any, _handler: Any) -> Any:
        return word_or_section(value, ("position",), (Slope, "κ"))

    @field_validator("law", mode="wrap")
    @classmethod
    def _check_law(cls, value: Any, _handler: Any) -> Any:
        if isinstance(value, dict) and "implicit" in value:
            raise value_error(
                "has implicit steps, which only a sliding controller has",
                "expected exact or {boundary_layer: width}",
            )
        return word_or_section(value, ("exact",), (BoundaryLayer, "width"))

    @property
    def form(self) -> str:
        """The form of the tie, a key of `SLIDING_TIES`."""
        if isinstance(self.law, BoundaryLayer):
            return "layer"
        return "position" if self.surface == "position" else "slope"


_BASES: dict[str, type[Section]] = {"sliding": SlidingKeys}
"""The models of the kinds that have keys besides gains."""


def _model(kind: str, method: str | None) -> type[Section]:
    """Return the model of a kind of element, and of the value of its selector if it has one."""
    element = KINDS[kind][method]
    fields: dict[str, Any] = {}
    base = _BASES.get(kind, Section)
    if base is Section:
        fields = {"kind": (Literal[kind], required("the kind of element"))}
    if method is not None:
        selector = SELECTORS[kind]
        fields[selector] = (Literal[method], required(_MEANINGS[selector]))
    fields |= gain_fields(element)
    fields |= initial_fields(element)
    documentation = (element.__doc__ or "").strip().splitlines()[0]
    if issubclass(element, Input):
        fields[SIGNAL] = (Signal, ...)
    words = f"{method or ''}-{kind}".title().replace("-", "").replace("_", "")
    return create_model(
        f"{words}Element",
        __base__=base,
        __doc__=documentation,
        **fields,
    )


ELEMENT_MODELS: dict[tuple[str, str | None], type[Section]] = {
    (kind, method): _model(kind, method) for kind, methods in KINDS.items() for method in methods
} | {(PYTHON, None): PythonElement}
"""The model of each kind and value of its selector."""


ALL_KINDS = (*KINDS, PYTHON)
"""The kinds of elements of a config: those of the program, and those of users."""


def _unknown_method(kind: str) -> type[Section]:
    """Return a model that rejects every selector but those of a kind, and checks nothing else."""
    methods = tuple(method for method in KINDS[kind] if method is not None)
    selector = SELECTORS[kind]
    name = f"{kind.title().replace('-', '')}{selector.title()}"
    fields: dict[str, Any] = {"kind": (Literal[kind], ...), selector: (Literal[methods], ...)}
    return create_model(
        name,
        __base__=Section,
        __doc__=f"An element {kind} of an unknown {selector}.",
        __cls_kwargs__={"extra": "ignore"},
        **fields,
    )


_UNKNOWN_METHOD = {kind: _unknown_method(kind) for kind in KINDS if None not in KINDS[kind]}

# Pickle finds a model by its name in this module.
globals().update({model.__name__: model for model in ELEMENT_MODELS.values()})


def element_model(value: Any) -> type[Section] | None:
    """Return the model of an element of a config; None if its kind is unknown."""
    kind = value.get("kind") if isinstance(value, dict) else None
    if not isinstance(kind, str) or kind not in ALL_KINDS:
        return None
    if kind not in _UNKNOWN_METHOD:
        return ELEMENT_MODELS[kind, None]
    method = value.get(SELECTORS[kind])
    known = isinstance(method, str) and method in KINDS[kind]
    return ELEMENT_MODELS[kind, method] if known else _UNKNOWN_METHOD[kind]


def keys_in(element: Any, path: Path) -> dict[str, str]:
    """Return the keys that a mapping in the data of an element may have, with their descriptions.

    Args:
        element: The data of the element, of a known kind.
        path: The path of the mapping in the element; empty for the element itself.
    """
    if element.get("kind") == PYTHON and path == (PARAMETERS,):
        return dict(sorted(parameters_in(element).items()))
    model = element_model(element)
    models = () if model is None else (model,)
    if path == (SIGNAL,):
        found = signal_model(element[SIGNAL])
        models = () if found is None else (found,)
    elif path:
        owner = () if model is None else get_args(model.model_fields[str(path[0])].annotation)
        models = tuple(one for one in owner if hasattr(one, "model_fields"))
    fields = [item for one in models for item in one.model_fields.items()]
    return dict(sorted((field.alias or name, field.description or "") for name, field in fields))


def declarations_of(section: Any) -> type[Element] | Declared:
    """Return what declares gains, modes and own states of an element of a config; runs no code."""
    return section.declared if isinstance(section, PythonElement) else element_of(section)


def gain_path(name: str, section: Any, gain: Gain) -> Path:
    """Return the path of a gain of an element in a config."""
    return _parameter_path(name, section, gain.name)


def initial_path(name: str, section: Any, state: OwnState) -> Path:
    """Return the path of the initial value of an own state of an element in a config."""
    return _parameter_path(name, section, state.initial_key)


def _parameter_path(name: str, section: Any, key: str) -> Path:
    inner = (PARAMETERS,) if isinstance(section, PythonElement) else ()
    return ("elements", name, *inner, key)


def gain_value(section: Any, gain: Gain) -> Any:
    """Return the value of a gain of an element."""
    return _parameter(section, gain.name)


def initial_value(section: Any, state: OwnState) -> Any:
    """Return the initial value of an own state of an element."""
    return _parameter(section, state.initial_key)


def _parameter(section: Any, key: str) -> Any:
    return section.parameters[key] if isinstance(section, PythonElement) else getattr(section, key)


def kind_of(section: Any) -> Kind:
    """Return what decides the units of an element of a config."""
    if isinstance(section, PythonElement):
        return Kind(section.kind, None, section.source, section.class_name)
    return Kind(section.kind, selected(section))


def switching(elements: Mapping[str, Any]) -> list[str]:
    """Return the names of the elements of a config that switch (`Element.mode_count`)."""
    return [name for name, section in elements.items() if declarations_of(section).mode_count]


def stops(elements: Mapping[str, Any]) -> list[str]:
    """Return the names of the stops of a config."""
    return [
        name
        for name, section in elements.items()
        if section.kind != PYTHON and element_of(section).holds
    ]


def reading_angles(controller: Any, elements: Mapping[str, Any]) -> list[str]:
    """Return what reads Euler angles in a config, or may read them: K_r, guards and users' code."""
    # Imported late: printing the schema does not need numpy.
    import numpy as np

    stiff = bool(np.any(getattr(controller, "K_r", 0.0)))
    names = [name for name, section in elements.items() if section.kind in ("guard", PYTHON)]
    return ["controller.K_r"] * stiff + names


def inputs(elements: Mapping[str, Any], *, with_legs: bool = False) -> list[str]:
    """Return the names of the inputs of a config.

    Args:
        elements: The elements.
        with_legs: Whether only those are wanted whose signals are made of legs.
    """
    return [
        name
        for name, section in elements.items()
        if section.kind == "input" and not (with_legs and section.signal.kind in SMOOTH_SIGNALS)
    ]


MAX_SLIDING = 3
"""The most ties that slide on s = F + κE: their forces are solved together."""


def sliding_ties(elements: Mapping[str, Any]) -> list[str]:
    """Return the names of the ties that slide on s = F + κE with the exact law."""
    return [
        name
        for name, section in elements.items()
        if section.kind == "sliding" and section.form == "slope"
    ]


def followed_by_modes(elements: Mapping[str, Any]) -> list[str]:
    """Return the names of the elements that switch, supply power, or have states of their own.

    Beside one of them the modes of a sliding connector are followed as those of elements.
    """
    return [
        name
        for name, section in elements.items()
        if section.kind == "input"
        or declarations_of(section).mode_count
        or declarations_of(section).states
    ]


def check_sliding_points(sliding: Mapping[str, Any]) -> None:
    """Raise a validation error if the forces on points that slide cannot be determined.

    Args:
        sliding: The points by the names of their ties, and that of a connector.
    """
    if len(sliding) > MAX_SLIDING:
        raise value_error(
            f"has {len(sliding)} sliding ties on slopes with the exact law: {', '.join(sliding)}",
            f"expected at most {MAX_SLIDING}; others may have a boundary layer",
        )
    first: dict[Any, str] = {}
    for name, point in sliding.items():
        if point in first:
            raise value_error(
                f"has the sliding ties {first[point]} and {name} at one point, so their forces "
                "are not determined",
                "expected one tie with the sum of K_s, or other points",
            )
        first[point] = name


def _check_name(name: Any) -> Any:
    if not isinstance(name, str) or not _NAME.fullmatch(name):
        raise value_error(
            "is not a name of an element",
            "expected a lower-case letter, then up to 39 lower-case letters, digits or _",
        )
    if name in RESERVED_NAMES:
        raise value_error("is a name that every system uses", "expected another name")
    return name


def _check_element(value: Any, _handler: Any, info: ValidationInfo) -> Any:
    if isinstance(value, tuple(ELEMENT_MODELS.values())):
        return value
    if not isinstance(value, dict):
        raise value_error("is not a mapping", "expected a mapping with the key kind")
    expected = f"expected kind: one of {', '.join(ALL_KINDS)}"
    if "kind" not in value:
        raise value_error("has no kind", expected)
    model = element_model(value)
    if model is None:
        raise value_error("has an unknown kind", expected + hint(value["kind"], ALL_KINDS))
    return model.model_validate(value, context=info.context)


def _in_order(elements: Any) -> Any:
    """Return the elements in the order of their names, which fixes the order of all sums."""
    if not isinstance(elements, dict):
        raise value_error("is not a mapping", "expected a mapping from names to elements")
    if len(elements) > MAX_ELEMENTS:
        raise value_error(f"has {len(elements)} entries", f"expected at most {MAX_ELEMENTS}")
    return {name: elements[name] for name in sorted(elements, key=str)}


_ANY_ELEMENT: Any = reduce(or_, ELEMENT_MODELS.values())
"""For the JSON Schema: `_check_element` chooses the model by the kind, for better messages."""

_NAMES = {"pattern": f"^{_NAME.pattern}$", "not": {"enum": list(RESERVED_NAMES)}}

Elements = Annotated[
    dict[
        Annotated[str, BeforeValidator(_check_name)],
        Annotated[_ANY_ELEMENT, WrapValidator(_check_element)],
    ],
    BeforeValidator(_in_order),
    AfterValidator(FrozenMapping),
    Field(
        description="elements by name; schema_version: 2",
        json_schema_extra={"maxProperties": MAX_ELEMENTS, "propertyNames": _NAMES},
    ),
]
