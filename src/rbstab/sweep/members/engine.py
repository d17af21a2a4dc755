"""What a sweep asks of whoever follows its members."""

from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np

from rbstab.integrate.status import RunStatus
from rbstab.mechanics.numbers import Array
from rbstab.sweep.members.outcome import COLUMNS, STATUSES
from rbstab.sweep.plan.plan import Plan

FAILED = (
    RunStatus.DIVERGED,
    RunStatus.STEP_LIMIT,
    RunStatus.SWITCH_LIMIT,
    RunStatus.TIME_LIMIT,
    RunStatus.SOLVER_FAILURE,
)
"""Ends of which the motion is not the cause, or perhaps not: such members can be tried again."""

FAILED_CODES = tuple(STATUSES.index(status) for status in FAILED)


class Shard(NamedTuple):
    """Consecutive members: each of `outcome.COLUMNS`, the first axis along members; their traces.

    traces has the samples (`time`) and each quantity of a trace by its name, the first axis along
    those members of which the plan keeps one; None where it keeps none of these.
    """

    outcome: dict[str, Array]
    traces: dict[str, Array] | None = None


class EngineError(Exception):
    """An engine raised an error in another process; in words, for not every error can be sent."""

    @classmethod
    def of(cls, error: BaseException) -> "EngineError":
        """What it was."""
        return cls(f"{type(error).__name__}: {error}")


class MemberEngine(Protocol):
    """Follows members; used by one thread."""

    def compute(self, start: int, stop: int) -> Shard:
        """The members from number `start` up to `stop`.

        What a motion does, or a failure of its integration, is a status and no exception. The bits
        of a member do not depend on how the members are cut.
        """
        ...


EngineFactory = Callable[[Plan], MemberEngine]
"""Makes an engine for one thread."""


def columns_of_failed(members: int) -> dict[str, Array]:
    """The columns of members of which nothing is known but that their integration failed."""
    found = {}
    for column in COLUMNS:
        shape = (members, *column.shape)
        kind = np.dtype(column.dtype).kind
        found[column.name] = np.full(shape, np.nan if kind == "f" else 0, dtype=column.dtype)
    found["run_id"] = np.zeros(members, dtype="S32")
    found["status"][:] = STATUSES.index(RunStatus.SOLVER_FAILURE)
    return found
