"""The engines by name, each imported only when it is asked for."""

from importlib import import_module

from rbstab.integrate.problem import Engine

ENGINES = {
    "scipy": "rbstab.integrate.scipy_engine",
    "heyoka": "rbstab.integrate.heyoka.engine",
}


class EngineMissingError(RuntimeError):
    """The engine's package is not installed here."""


def engine(name: str) -> Engine:
    """The engine of that name.

    Args:
        name: A key of `ENGINES`.

    Raises:
        EngineMissingError: Its package cannot be imported (heyoka has wheels for Linux only).
    """
    try:
        module = import_module(ENGINES[name])
    except ImportError as error:
        raise EngineMissingError(
            f"the engine '{name}' cannot be used here: {error}; "
            "heyoka is on PyPI for Linux and on conda-forge for other systems, "
            "or use the engine 'scipy'"
        ) from error
    integrate: Engine = module.integrate
    return integrate
