"""Which engine follows the members of a plan."""

from rbstab.integrate.engines import EngineMissingError, engine
from rbstab.sweep.members.engine import EngineFactory
from rbstab.sweep.members.single import SingleRuns


def fastest() -> str:
    """The name of the fastest engine that can be used here."""
    try:
        engine("heyoka")
    except EngineMissingError:
        return "scipy"
    return "heyoka"


def factory_for(name: str) -> EngineFactory:
    """What follows the members of plans whose engine is of this name.

    Raises:
        EngineMissingError: The engine's package is not installed.
    """
    engine(name)
    if name != "heyoka":
        return SingleRuns
    # Imported late: it needs heyoka.
    from rbstab.sweep.members.ensemble import ensemble_engine

    return ensemble_engine
