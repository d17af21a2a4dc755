"""The statuses with which a run ends."""

from enum import StrEnum


class RunStatus(StrEnum):
    """The status of a run at its end. Only `COMPLETED` means that it reached the last sample."""

    COMPLETED = "completed"
    """The run reached the last sample."""

    RANGE_LEFT = "range left"
    """cos θ2 fell to `integration.range_bound`; at zero, Euler angles are singular (eq. 5)."""

    DIVERGED = "diverged"
    """A state or a rate became infinite or not a number."""

    STEP_LIMIT = "step limit"
    """The run reached its limit of steps."""

    SWITCH_LIMIT = "switch limit"
    """The run reached its limit of switches."""

    TIME_LIMIT = "time limit"
    """The run reached its limit of wall time."""

    SOLVER_FAILURE = "solver failure"
    """The integrator failed, for example because its step became too small."""

    ZERO_LENGTH = "zero length"
    """The length of a spring fell to zero, where its direction is undefined."""

    CRASHED = "crashed"
    """Every process that computed this member of a sweep ended."""

    @property
    def depends_on_machine(self) -> bool:
        """Whether the same run may end differently on another machine, or when repeated."""
        return self is RunStatus.TIME_LIMIT


class StopRun(Exception):
    """Ends a run, with its status and reason."""

    def __init__(self, status: RunStatus, reason: str) -> None:
        super().__init__(reason)
        self.status = status


class UnfinishedRunError(RuntimeError):
    """A run stopped early, but its complete trajectory is needed.

    Attributes:
        status: The status of the run.
    """

    def __init__(self, status: RunStatus, detail: str) -> None:
        self.status = status
        super().__init__(f"{status}: {detail}")
