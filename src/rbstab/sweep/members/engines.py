"""Select the engine that integrates the members of a plan."""

from rbstab.integrate.engines import EngineMissingError, engine
from rbstab.sweep.members.engine import EngineFactory
from rbstab.sweep.members.single import SingleRuns


def fastest_engine() -> str:
    """Return the name of the fastest engine that is installed."""
    try:
        engine("heyoka")
    except EngineMissingError:
        return "scipy"
    return "heyoka"


def factory_for(name: str) -> EngineFactory:
    """Return the factory of the engine with this name.

    Raises:
        EngineMissingError: The engine's package is not installed.
    """
    engine(name)
    if name != "heyoka":
        return SingleRuns
    # Imported late, because it needs heyoka.
    from rbstab.sweep.members.ensemble import ensemble_engine

    return ensemble_engine
