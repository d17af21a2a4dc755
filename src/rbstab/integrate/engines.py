"""The engines by name. An engine is imported only when it is used."""

from importlib import import_module

from rbstab.integrate.in_quaternions import InQuaternions
from rbstab.integrate.problem import Engine

ENGINES = {
    "scipy": "rbstab.integrate.scipy_engine",
    "heyoka": "rbstab.integrate.heyoka.engine",
}

STEPS_PER_INTERVAL = {"scipy": 8, "heyoka": 1}
"""By engine, the most steps between two samples that show how the body turns."""


INSTALL_HEYOKA = "install heyoka from PyPI (Linux) or conda-forge (other systems)"


class EngineMissingError(RuntimeError):
    """The package of an engine cannot be imported."""


def engine(name: str) -> Engine:
    """Return an engine.

    Args:
        name: A key of `ENGINES`.

    Raises:
        EngineMissingError: The package of the engine cannot be imported.
    """
    try:
        module = import_module(ENGINES[name])
    except ImportError as error:
        raise EngineMissingError(
            f"the engine '{name}' cannot be used here: {error}; {INSTALL_HEYOKA}, "
            "or use the engine 'scipy'"
        ) from error
    return InQuaternions(module.integrate, STEPS_PER_INTERVAL[name])
