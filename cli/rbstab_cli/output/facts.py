"""A run as plain data for JSON."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rbstab.store.result import Result


def run_data(result: "Result") -> dict[str, Any]:
    """Return the attributes and the summary of a result."""
    from rbstab.experiment.summary import summary_of

    data: dict[str, Any] = dict(result.attributes)
    data["warnings"] = str(data.get("warnings", "")).splitlines()
    return {**data, **summary_of(result)._asdict()}
