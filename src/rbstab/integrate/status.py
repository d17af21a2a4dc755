"""How a run ended."""

from enum import StrEnum


class RunStatus(StrEnum):
    """Every way a run can end; only `COMPLETED` reached the last sample."""

    COMPLETED = "completed"
    """The motion was followed to the end."""

    RANGE_LEFT = "range left"
    """cos θ2 fell to its bound: B(Θ) is about to become singular (eq. 5)."""

    DIVERGED = "diverged"
    """A state or a rate became infinite or not a number."""

    STEP_LIMIT = "step limit"
    """The allowed number of steps was used up."""

    SWITCH_LIMIT = "switch limit"
    """The allowed number of switches of a sliding connector was used up."""

    TIME_LIMIT = "time limit"
    """The allowed wall time was used up."""

    SOLVER_FAILURE = "solver failure"
    """The integrator gave up, for instance because no step was small enough."""

    @property
    def depends_on_machine(self) -> bool:
        """Whether the same run may end otherwise elsewhere, or at another time."""
        return self is RunStatus.TIME_LIMIT


class UnfinishedRunError(RuntimeError):
    """A run did not complete where its whole motion is needed.

    Attributes:
        status: How it ended.
    """

    def __init__(self, status: RunStatus, detail: str) -> None:
        self.status = status
        super().__init__(f"{status}: {detail}")
