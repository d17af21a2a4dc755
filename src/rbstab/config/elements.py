"""The elements of the config schema: any number of them, each with a name and a kind.

The fields of a kind follow from the declarations of its element (`rbstab.elements.registry.KINDS`).
"""

import re
from functools import reduce
from operator import or_
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field, WrapValidator, create_model

from rbstab.config.controllers import gain_fields
from rbstab.config.quantities import value_error
from rbstab.config.section import FrozenMapping, Section, required
from rbstab.elements.registry import KINDS

MAX_ELEMENTS = 100

RESERVED_NAMES = ("anchor", "body", "connector", "gravity", "kinetic")
"""Names that parts of every system have."""

_NAME = re.compile(r"[a-z][a-z0-9_]{0,39}")

METHODS = {"guard": "barrier"}
"""The methods of the kinds that have one."""


def _model(kind: str) -> type[Section]:
    """Return the model of a kind of element."""
    element = KINDS[kind]
    fields: dict[str, Any] = {"kind": (Literal[kind], required("the kind of element"))}
    if kind in METHODS:
        fields["method"] = (Literal[METHODS[kind]], required("how the range is guarded"))
    documentation = (element.__doc__ or "").strip().splitlines()[0]
    name = f"{kind.title().replace('-', '')}Element"
    return create_model(
        name, __base__=Section, __doc__=documentation, **fields, **gain_fields(element)
    )


ELEMENT_MODELS: dict[str, type[Section]] = {kind: _model(kind) for kind in KINDS}
"""The model of each kind."""

# Pickle finds a model by its name in this module.
globals().update({model.__name__: model for model in ELEMENT_MODELS.values()})


def element_model(value: Any) -> type[Section] | None:
    """Return the model of an element of a config; None if its kind is unknown."""
    kind = value.get("kind") if isinstance(value, dict) else None
    return ELEMENT_MODELS.get(kind) if isinstance(kind, str) else None


def _check_name(name: Any) -> Any:
    if not isinstance(name, str) or not _NAME.fullmatch(name):
        raise value_error(
            "is not a name of an element",
            "expected a lower-case letter, then up to 39 lower-case letters, digits or _",
        )
    if name in RESERVED_NAMES:
        raise value_error("is a name that every system uses", "expected another name")
    return name


def _check_element(value: Any, _handler: Any) -> Any:
    if isinstance(value, tuple(ELEMENT_MODELS.values())):
        return value
    if not isinstance(value, dict):
        raise value_error("is not a mapping", "expected a mapping with the key kind")
    expected = f"expected kind: one of {', '.join(KINDS)}"
    if "kind" not in value:
        raise value_error("has no kind", expected)
    model = element_model(value)
    if model is None:
        raise value_error("has an unknown kind", expected)
    return model.model_validate(value)


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
