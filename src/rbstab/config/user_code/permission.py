"""The permission to run the files of users' elements.

It belongs to a loaded config, and is in no file: a result or a plan of someone else never brings it
along. Whatever is made of a permitted config has it too, also in another process.
"""

from enum import Enum
from typing import Any

from rbstab.config.user_code.section import PythonElement
from rbstab.elements.element import Element
from rbstab.elements.user_code.loaded import (
    element_class,
)

REFUSED = (
    "expected --allow-python, or allow_python=True in Python: this file runs with all your rights, "
    "so read it first"
)


class Code(Enum):
    """What becomes of the code of users in a config or a plan that is loaded."""

    REFUSED = "what has code is refused"
    NOT_RUN = "it is read, and cannot be run"
    ALLOWED = "it may be run"


class CodeNotAllowedError(Exception):
    """The file of a user's element would have to run, but the config was loaded without that."""


def permitted_class(name: str, element: PythonElement) -> type[Element]:
    """Run the file of a user's element, if that is permitted, and return its class.

    Raises:
        CodeNotAllowedError: It is not permitted.
        UserCodeError: The file cannot be run, or the class is not an element.
    """
    if not element.may_run:
        raise CodeNotAllowedError(f"elements.{name} is code of {element.code.file} ({REFUSED})")
    return element_class(element.code, element.class_name)


def may_run_code(config: Any) -> bool:
    """Return whether the files of users' elements may be run, if a config has any."""
    return any(element.may_run for element in of_users(config).values())


def may_build(config: Any) -> bool:
    """Return whether the equations of a config can be built: it has no code, or this may run."""
    return may_run_code(config) or not has_code(config)


def has_code(config: Any) -> bool:
    """Return whether a config has elements of users."""
    return bool(of_users(config))


def switching_code(config: Any) -> list[str]:
    """Return the names of users' elements with switches or own states, as their files say."""
    elements = of_users(config).items()
    return [
        name for name, element in elements if element.declared.mode_count or element.declared.states
    ]


def without_code(config: Any) -> Any:
    """Return a config without its elements of users, for what does not depend on them."""
    return without_names(config, list(of_users(config)))


def of_users(config: Any) -> dict[str, PythonElement]:
    """Return the elements of users in a config, by their names."""
    return {
        name: element
        for name, element in config.elements.items()
        if isinstance(element, PythonElement)
    }


def without_names(config: Any, names: list[str]) -> Any:
    """Return a config without the elements of these names."""
    if not names:
        return config
    kept = {name: element for name, element in config.elements.items() if name not in names}
    return config.model_copy(update={"elements": type(config.elements)(kept)})
