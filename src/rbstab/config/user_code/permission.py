"""The permission to run the files of users' elements.

It belongs to a loaded config, and is in no file: a result or a plan of someone else never brings it
along. Whatever is made of a permitted config has it too, also in another process.
"""

from typing import Any

from rbstab.config.errors import ConfigError, ConfigProblem
from rbstab.config.source import Source, key_of
from rbstab.config.user_code.section import PythonElement
from rbstab.elements.element import Element
from rbstab.elements.user_code.loaded import element_class

REFUSED = (
    "expected --allow-python, or allow_python=True in Python: this file runs with all your rights, "
    "so read it first"
)


TESTED = "`rbstab check --element FILE` tests the statements of a file"


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
    return any(element.may_run for element in _of_users(config).values())


def may_build(config: Any) -> bool:
    """Return whether the equations of a config can be built: it has no code, or this may run."""
    return may_run_code(config) or not has_code(config)


def has_code(config: Any) -> bool:
    """Return whether a config has elements of users."""
    return bool(_of_users(config))


def switching_code(config: Any) -> list[str]:
    """Return the names of users' elements with switches or own states, as their files say."""
    elements = _of_users(config).items()
    return [name for name, one in elements if one.declared.mode_count or one.declared.states]


def without_code(config: Any) -> Any:
    """Return a config without its elements of users, for what does not depend on them."""
    return _without(config, list(_of_users(config)))


def only_code_of(config: Any, name: str) -> Any:
    """Return a config with one of its elements of users, and none of the others."""
    others = [other for other in _of_users(config) if other != name]
    return _without(config, others)


def check_code(config: Any, source: Source, *, allow_python: bool) -> None:
    """Refuse a config with elements of users, or try them if that is allowed.

    Args:
        config: The config.
        source: Its source, for locations.
        allow_python: Whether the files may run.

    Raises:
        ConfigError: They may not, or a file cannot be run, its class is not an element, or one of
            its statements fails at the start of the config.
    """
    problems = []
    for name, element in _of_users(config).items():
        found, expected = f"is python: {element.code.file} is code that would run", REFUSED
        if allow_python:
            # Imported late: few configs have code, and building one needs its equations.
            from rbstab.config.user_code.trial import problem_at_start

            at_start = problem_at_start(config, name)
            if at_start is None:
                continue
            found, expected = f"{element.code.file}: {at_start}", TESTED
        path = ("elements", name, "class" if allow_python else "kind")
        problems.append(ConfigProblem(source.location(path), key_of(path), found, expected))
    if problems:
        raise ConfigError(problems)


def _of_users(config: Any) -> dict[str, PythonElement]:
    return {
        name: element
        for name, element in config.elements.items()
        if isinstance(element, PythonElement)
    }


def _without(config: Any, names: list[str]) -> Any:
    if not names:
        return config
    kept = {name: one for name, one in config.elements.items() if name not in names}
    return config.model_copy(update={"elements": type(config.elements)(kept)})
