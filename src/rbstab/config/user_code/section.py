"""The section of an element of a user: `kind: python`.

Its parameters are checked against what the class declares. This needs the text of its file, but
never runs it.
"""

import re
from functools import lru_cache
from typing import Annotated, Any, Literal

from pydantic import (
    AfterValidator,
    BeforeValidator,
    Field,
    PrivateAttr,
    SerializerFunctionWrapHandler,
    ValidationInfo,
    create_model,
    field_validator,
    model_serializer,
)

from rbstab.config.controllers import gain_fields, initial_fields
from rbstab.config.quantities import Text, value_error
from rbstab.config.section import FrozenMapping, Section, required
from rbstab.elements.element import Element
from rbstab.elements.user_code.declared import (
    MAX_SOURCE,
    DeclarationError,
    Declared,
    classes_of,
    declared,
    sha256,
)
from rbstab.elements.user_code.loaded import UserCode

KIND = "python"

PARAMETERS = "parameters"
"""The key under which the gains of an element of a user stand."""

ALLOW = "allow_python"
"""The entry of a validation's context that says whether the code of users may run."""

DOCUMENTED = "docs/own_elements.md describes the declarations"

_CLASS = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,99}")


def _check_class(name: str) -> str:
    if not _CLASS.fullmatch(name):
        raise value_error("is not the name of a class", "expected letters, digits and _")
    return name


def _check_source(text: str) -> str:
    if len(text) > MAX_SOURCE:
        problem = f"has {len(text)} characters"
        raise value_error(problem, f"expected at most {MAX_SOURCE}")
    try:
        classes_of(text)
    except DeclarationError as error:
        raise value_error(str(error), "expected the text of a Python file") from error
    return text


def _check_mapping(value: Any) -> Any:
    if not isinstance(value, dict):
        raise value_error("is not a mapping", "expected a mapping from names to values")
    return value


class PythonElement(Section):
    """An element of a user: a class in a Python file."""

    kind: Literal["python"] = required("the kind of element")
    source: Annotated[str, AfterValidator(_check_source)] | None = Field(
        None, description="the text of the file; read from `file`"
    )
    file: Text | None = Field(
        None,
        validate_default=True,
        description="the Python file, relative to the config; beside `source` only a name",
    )
    sha256: str | None = Field(
        None,
        validate_default=True,
        description="the SHA-256 of the text; a file with another one is refused",
    )
    class_name: Annotated[str, AfterValidator(_check_class)] = Field(
        alias="class", description="the class in the file"
    )
    parameters: Annotated[dict[str, Any], BeforeValidator(_check_mapping)] = Field(
        default_factory=FrozenMapping,
        validate_default=True,
        description="the gains and initial states that the class declares, by name",
    )

    _may_run: bool = PrivateAttr(default=False)

    @model_serializer(mode="wrap")
    def _in_reading_order(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Return the section with its text at the end; it is validated first."""
        data: dict[str, Any] = handler(self)
        return {key: data[key] for key in sorted(data, key=lambda key: key == "source")}

    def model_post_init(self, context: Any, /) -> None:
        """Keep the permission of the validation: only then may the code run."""
        self._may_run = bool(context) and context.get(ALLOW) is True

    @property
    def may_run(self) -> bool:
        """Whether the user allowed that the code runs. It is in no file and in no identity."""
        return self._may_run

    @property
    def code(self) -> UserCode:
        """The text of the file."""
        assert self.source is not None
        return UserCode(self.source, self.file or "the element's source")

    @property
    def declared(self) -> Declared:
        """What the class declares."""
        assert self.source is not None
        return declared(self.source, self.class_name)

    @field_validator("file")
    @classmethod
    def _check_read(cls, file: str | None, info: ValidationInfo) -> str | None:
        if info.data.get("source", "") is None:
            problem = "is missing" if file is None else "was not read"
            raise value_error(problem, "expected a Python file, relative to the config")
        return file

    @field_validator("sha256")
    @classmethod
    def _check_digest(cls, digest: str | None, info: ValidationInfo) -> str | None:
        source = info.data.get("source")
        actual = None if source is None else sha256(source)
        if digest is not None and actual is not None and digest != actual:
            problem = f"is not the SHA-256 of the file, {actual}"
            raise value_error(problem, "expected the file that this digest was made of")
        return actual

    @field_validator("class_name")
    @classmethod
    def _check_declared(cls, name: str, info: ValidationInfo) -> str:
        source = info.data.get("source")
        if source is not None:
            try:
                declared(source, name)
            except DeclarationError as error:
                raise value_error(f"{name}: {error}", error.expected or DOCUMENTED) from error
        return name

    @field_validator("parameters")
    @classmethod
    def _check_parameters(cls, given: dict[str, Any], info: ValidationInfo) -> FrozenMapping:
        source, name = info.data.get("source"), info.data.get("class_name")
        if source is None or name is None:
            return FrozenMapping(given)
        stated = declared(source, name)
        checked = _parameters_model(stated).model_validate(given)
        names = _parameter_fields(stated)
        return FrozenMapping({name: getattr(checked, f"field_{k}") for k, name in enumerate(names)})


@lru_cache(64)
def _parameters_model(stated: Declared) -> type[Section]:
    """Return the model of the parameters of an element; field k is the parameter number k."""
    # A gain may have the name of an attribute of every model, such as `copy`.
    fields: dict[str, Any] = {
        f"field_{k}": (Annotated[kind, Field(alias=name)], field)
        for k, (name, (kind, field)) in enumerate(_parameter_fields(stated).items())
    }
    return create_model("Parameters", __base__=Section, **fields)


def _parameter_fields(stated: Declared) -> dict[str, Any]:
    """Return the fields of the parameters: the gains, then the initial values of own states."""
    return gain_fields(stated) | initial_fields(stated)


def parameters_in(element: Any) -> dict[str, str]:
    """Return the units of the parameters of an element of a user, by name.

    Args:
        element: The element in the data of a config; if it is wrong, it has no parameters.
    """
    try:
        stated = declared(element["source"], element["class"])
    except (DeclarationError, KeyError, TypeError):
        return {}
    return parameter_units(stated)


def parameter_units(stated: type[Element] | Declared) -> dict[str, str]:
    """Return the units of the gains and of the initial values of own states, by key."""
    units = {gain.name: gain.unit for gain in stated.gains}
    return units | {state.initial_key: state.unit for state in stated.states}
