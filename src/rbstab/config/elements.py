"""The elements of the config schema: any number of them, each with a name and a kind.

The fields of a kind follow from the declarations of its element (`rbstab.elements.registry.KINDS`).
"""

import re
from collections.abc import Callable, Mapping
from functools import reduce
from operator import or_
from typing import Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    BeforeValidator,
    Field,
    ValidationInfo,
    create_model,
    field_validator,
)

from rbstab.config.controllers import BoundaryLayer, Surface, gain_fields, initial_fields
from rbstab.config.quantities import value_error
from rbstab.config.section import FrozenMapping, Section, required, word_or
from rbstab.config.sections.actuators import OF_TIES
from rbstab.config.sections.signals import SMOOTH_SIGNALS, Signal, extremes
from rbstab.config.source import Path
from rbstab.config.user_code.section import KIND as PYTHON
from rbstab.config.user_code.section import PARAMETERS, PythonElement
from rbstab.elements.element import Element
from rbstab.elements.inputs.signals import Driven
from rbstab.elements.registry import KINDS, SELECTORS, element_of
from rbstab.elements.user_code.declared import Declared

MAX_ELEMENTS = 100

SIGNAL = "signal"
"""The key of the signal of an element."""

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
    surface: Surface
    law: Annotated[
        Literal["exact"] | BoundaryLayer,
        word_or(("exact",), (BoundaryLayer, "width")),
        Field(description="exact or {boundary_layer: width}"),
    ] = "exact"

    @property
    def form(self) -> str:
        """The form of the tie, a key of `SLIDING_TIES`."""
        if isinstance(self.law, BoundaryLayer):
            return "layer"
        return "position" if self.surface == "position" else "slope"


class CoactivatedKeys(Section):
    """The kind of a coactivated tie, and the checks of its activation."""

    kind: Literal["coactivated"] = required("the kind of element")

    @field_validator("initial_rise", "signal", check_fields=False)
    @classmethod
    def _check_activation(cls, value: Any, info: ValidationInfo) -> Any:
        """Check that the activation begins between 0 and 1, and that the excitation stays there."""
        rest, factor = info.data.get("excitation"), info.data.get("amplitude")
        if rest is None or factor is None:
            return value  # they have a problem already
        name, rises, expected = "activation at the start", value, "0 to 1"
        if info.field_name == SIGNAL:
            name, rises = "excitation", [factor * s for s in extremes(value)]
            expected = "a signal that keeps it from 0 to 1, as a noise does not"
        for level in (rest + rise for rise in rises):
            if not 0 <= level <= 1:
                raise value_error(f"makes the {name} {level:g}", f"expected {expected}")
        return value


_BASES: dict[str, type[Section]] = {"sliding": SlidingKeys, "coactivated": CoactivatedKeys}
"""The models of the kinds that have keys besides gains, or checks of their own."""


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
    fields |= OF_TIES.get(kind, {})
    if issubclass(element, Driven):
        fields[SIGNAL] = (Signal, ...)
    words = f"{method or ''}-{kind}".title().replace("-", "").replace("_", "")
    return create_model(
        f"{words}Element",
        __base__=base,
        __doc__=documentation,
        **fields,
    )


def declarations_of(section: Any) -> type[Element] | Declared:
    """Return what declares gains, modes and own states of an element of a config; runs no code."""
    return section.declared if isinstance(section, PythonElement) else element_of(section)


def parameter_path(name: str, section: Any, key: str) -> Path:
    """Return the path of a gain, or of the initial value of a state, of an element in a config.

    Args:
        name: The name of the element.
        section: Its section.
        key: The key below the section, or below the parameters of an element of a user.
    """
    inner = (PARAMETERS,) if isinstance(section, PythonElement) else ()
    return ("elements", name, *inner, *key.split("."))


def parameter(section: Any, key: str) -> Any:
    """Return the value of a gain, or the initial value of a state, of an element."""
    if isinstance(section, PythonElement):
        return section.parameters[key]
    return reduce(getattr, key.split("."), section)


def _named(elements: Mapping[str, Any], test: Callable[[Any], Any]) -> list[str]:
    """Return the names of the elements of a config that pass a test."""
    return [name for name, section in elements.items() if test(section)]


def switching(elements: Mapping[str, Any]) -> list[str]:
    """Return the names of the elements of a config that switch (`Element.mode_count`)."""
    return _named(elements, lambda section: declarations_of(section).mode_count)


def stops(elements: Mapping[str, Any]) -> list[str]:
    """Return the names of the stops of a config."""
    return _named(elements, lambda section: section.kind != PYTHON and element_of(section).holds)


def reading_angles(controller: Any, elements: Mapping[str, Any]) -> list[str]:
    """Return what may read Euler angles in a config: K_r, motors, guards and code of users."""
    # Imported late: printing the schema does not need numpy.
    import numpy as np

    stiff = bool(np.any(getattr(controller, "K_r", 0.0)))
    names = _named(elements, lambda section: section.kind in ("guard", PYTHON))
    motors = getattr(controller, "actuators", None) is not None
    return ["controller.K_r"] * stiff + ["controller.actuators"] * motors + names


def inputs(elements: Mapping[str, Any], *, with_legs: bool = False) -> list[str]:
    """Return the names of the elements with a signal; only those of legs, if wanted."""
    smooth = SMOOTH_SIGNALS if with_legs else ()
    return _named(
        elements, lambda section: hasattr(section, SIGNAL) and section.signal.kind not in smooth
    )


MAX_SLIDING = 3
"""The most ties that slide on s = F + κE: their forces are solved together."""


def sliding_ties(elements: Mapping[str, Any]) -> list[str]:
    """Return the names of the ties that slide on s = F + κE with the exact law."""
    return _named(elements, lambda section: section.kind == "sliding" and section.form == "slope")


def followed_by_modes(elements: Mapping[str, Any]) -> list[str]:
    """Return the names of the elements that switch, supply power, or have states of their own.

    Beside one of them the modes of a sliding connector are followed as those of elements.
    """

    def is_followed(section: Any) -> bool:
        declared = declarations_of(section)
        return section.kind == "input" or bool(declared.mode_count or declared.states)

    return _named(elements, is_followed)


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


def _in_order(elements: Any) -> Any:
    """Return the elements in the order of their names, which fixes the order of all sums."""
    if not isinstance(elements, dict):
        raise value_error("is not a mapping", "expected a mapping from names to elements")
    if len(elements) > MAX_ELEMENTS:
        raise value_error(f"has {len(elements)} entries", f"expected at most {MAX_ELEMENTS}")
    return {name: elements[name] for name in sorted(elements, key=str)}


def _of_kind(kind: str) -> Any:
    """Return the model of a kind; its selector, if it has one, tells several apart."""
    models = [_model(kind, method) for method in KINDS[kind]]
    if len(models) == 1:
        return models[0]
    return Annotated[reduce(or_, models), Field(discriminator=SELECTORS[kind])]


_Element: Any = Annotated[
    reduce(or_, (*map(_of_kind, KINDS), PythonElement)), Field(discriminator="kind")
]

_NAMES = {"pattern": f"^{_NAME.pattern}$", "not": {"enum": list(RESERVED_NAMES)}}

Elements = Annotated[
    dict[
        Annotated[str, BeforeValidator(_check_name)],
        _Element,
    ],
    BeforeValidator(_in_order),
    AfterValidator(FrozenMapping),
    Field(
        description="elements by name; schema_version: 2",
        json_schema_extra={"maxProperties": MAX_ELEMENTS, "propertyNames": _NAMES},
    ),
]
