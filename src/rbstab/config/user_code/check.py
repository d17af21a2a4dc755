"""The check of users' elements when a config is loaded: refused, or tried at the start."""

from typing import Any

from rbstab.config.errors import ConfigError
from rbstab.config.source import Source
from rbstab.config.user_code.permission import REFUSED, of_users, without_names
from rbstab.elements.user_code.declared import DeclarationError
from rbstab.elements.user_code.loaded import UserCodeError, failure, wrong_values

TESTED = "`rbstab check --element FILE` tests the statements of a file"


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
    for name, element in of_users(config).items():
        problem, expected = f"is python: {element.code.file} is code that would run", REFUSED
        if allow_python:
            at_start = _problem_at_start(config, name)
            if at_start is None:
                continue
            problem, expected = f"{element.code.file}: {at_start}", TESTED
        path = ("elements", name, "class" if allow_python else "kind")
        problems.append(source.problem(path, problem, expected))
    if problems:
        raise ConfigError(problems)


def _problem_at_start(config: Any, name: str) -> str | None:
    """Return what is wrong with an element of a user at the start of a config; None if nothing."""
    # Imported late: few configs have code, and building one needs its equations.
    import numpy as np

    from rbstab.config.build import start_of, system_of

    code = config.elements[name].code
    try:
        with np.errstate(all="ignore"):
            others = [other for other in of_users(config) if other != name]
            system = system_of(without_names(config, others))
            motion, pairs = system.acting(start_of(config, system))
            element, states = next(pair for pair in pairs if pair[0].name == name)
            return next(wrong_values(element, motion, states), None)
    except (UserCodeError, DeclarationError) as error:
        return str(error)
    except Exception as error:
        return f"it fails at the start: {failure(code, error)}"
