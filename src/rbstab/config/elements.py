"""The elements of the config schema: any number of them, each with a name and a kind.

The fields of a kind follow from the declarations of its element (`rbstab.elements.registry.KINDS`).
"""

import re
from collections.abc import Mapping
from functools import reduce
from operator import or_
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field, WrapValidator, create_model

from rbstab.config.controllers import gain_fields
from rbstab.config.errors import closest
from rbstab.config.quantities import value_error
from rbstab.config.section import FrozenMapping, Section, required
from rbstab.elements.registry import KINDS, element_of

MAX_ELEMENTS = 100

RESERVED_NAMES = ("anchor", "body", "connector", "gravity", "kinetic")
"""Names that parts of every system have."""

_NAME = re.compile(r"[a-z][a-z0-9_]{0,39}")


def _model(kind: str, method: str | None) -> type[Section]:
    """Return the model of a kind of element, and of its method if it has several."""
    element = KINDS[kind][method]
    fields: dict[str, Any] = {"kind": (Literal[kind], required("the kind of element"))}
    if method is not None:
        fields["method"] = (Literal[method], required("how the range is guarded"))
    documentation = (element.__doc__ or "").strip().splitlines()[0]
    words = f"{method or ''}-{kind}".title().replace("-", "")
    return create_model(
        f"{words}Element",
        __base__=Section,
        __doc__=documentation,
        **fields,
        **gain_fields(element),
    )


ELEMENT_MODELS: dict[tuple[str, str | None], type[Section]] = {
    (kind, method): _model(kind, method) for kind, methods in KINDS.items() for method in methods
}
"""The model of each kind and method."""


def _unknown_method(kind: str) -> type[Section]:
    """Return a model that rejects every method but those of a kind, and checks nothing else."""
    methods = tuple(method for method in KINDS[kind] if method is not None)
    name = f"{kind.title().replace('-', '')}Method"
    fields: dict[str, Any] = {"kind": (Literal[kind], ...), "method": (Literal[methods], ...)}
    return create_model(
        name,
        __base__=Section,
        __doc__=f"An element {kind} of an unknown method.",
        __cls_kwargs__={"extra": "ignore"},
        **fields,
    )


_UNKNOWN_METHOD = {kind: _unknown_method(kind) for kind in KINDS if None not in KINDS[kind]}

# Pickle finds a model by its name in this module.
globals().update({model.__name__: model for model in ELEMENT_MODELS.values()})


def element_model(value: Any) -> type[Section] | None:
    """Return the model of an element of a config; None if its kind is unknown."""
    kind = value.get("kind") if isinstance(value, dict) else None
    if not isinstance(kind, str) or kind not in KINDS:
        return None
    if kind not in _UNKNOWN_METHOD:
        return ELEMENT_MODELS[kind, None]
    method = value.get("method")
    known = isinstance(method, str) and method in KINDS[kind]
    return ELEMENT_MODELS[kind, method] if known else _UNKNOWN_METHOD[kind]


def switching(elements: Mapping[str, Any]) -> list[str]:
    """Return the names of the elements of a config that switch (`Element.mode_count`)."""
    return [name for name, section in elements.items() if element_of(section).mode_count]


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
        kind = value["kind"]
        close = closest(kind, KINDS) if isinstance(kind, str) else None
        hint = f", did you mean {close}?" if close is not None else ""
        raise value_error("has an unknown kind", expected + hint)
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
