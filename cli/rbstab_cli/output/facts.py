"""What is known of a run, as plain data for machines."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rbstab.store.result import Result


def facts_of(result: "Result") -> dict[str, Any]:
    """The attributes and the summary of a result."""
    from rbstab.experiment.summary import summary_of

    facts: dict[str, Any] = dict(result.attributes)
    facts["warnings"] = str(facts.get("warnings", "")).splitlines()
    return {**facts, **summary_of(result)._asdict()}
