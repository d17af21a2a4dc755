"""Interface of the engines that integrate the members of a sweep."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple, Protocol

import numpy as np

from rbstab.integrate.status import RunStatus
from rbstab.mechanics.numbers import Array
from rbstab.store.table import Layout
from rbstab.sweep.members.outcome import COLUMNS, STATUSES
from rbstab.sweep.members.traces import layout_of
from rbstab.sweep.plan.plan import Plan

FAILED = (
    RunStatus.DIVERGED,
    RunStatus.STEP_LIMIT,
    RunStatus.SWITCH_LIMIT,
    RunStatus.TIME_LIMIT,
    RunStatus.SOLVER_FAILURE,
    RunStatus.CRASHED,
)
"""Statuses of failed integrations. The motion may not be the cause; such members can be retried."""

FAILED_CODES = tuple(STATUSES.index(status) for status in FAILED)


class Shard(NamedTuple):
    """The results of consecutive members.

    Args:
        outcome: The data of each of `outcome_columns` by its name; the first axis is along members.
        traces: The sample times (`time`), and the quantities of the traces by name. Their first
            axis is along the members that the plan selects for a trace. None if it selects none.
    """

    outcome: dict[str, Array]
    traces: dict[str, Array] | None = None


class MemberEngine(Protocol):
    """Interface of an engine that integrates members, used by one thread."""

    def compute(self, start: int, stop: int) -> Shard:
        """Integrate the members from number `start` up to `stop`.

        An event of the motion, or a failed integration, gives a status and raises no exception. The
        bits of the results do not depend on `start` and `stop`.

        Args:
            start: The first member.
            stop: One after the last member, as in `range`.
        """
        ...


EngineFactory = Callable[[Plan], MemberEngine]
"""Makes an engine for one thread."""


def columns_of_failed(members: int, columns: Layout = COLUMNS) -> dict[str, Array]:
    """Return the columns of members whose integration failed without results.

    Args:
        members: The number of members.
        columns: The columns, from `outcome_columns`.
    """
    arrays = {}
    for name, column in columns.items():
        shape = (members, *column.shape)
        kind = np.dtype(column.dtype).kind
        arrays[name] = np.full(shape, np.nan if kind == "f" else 0, dtype=column.dtype)
    arrays["status"][:] = STATUSES.index(RunStatus.SOLVER_FAILURE)
    return arrays


def failed_shard(plan: Plan, start: int, stop: int, columns: Layout) -> Shard:
    """Return members as failed, to be filled with results.

    Args:
        plan: The plan.
        start: The number of the first member.
        stop: The number after the last member.
        columns: The columns, from `outcome_columns`.
    """
    traced = int(plan.keep.selected(start, stop).sum())
    traces = layout_of(plan).empty(traced) if traced else None
    return Shard(columns_of_failed(stop - start, columns), traces)


def concatenated(parts: Sequence[Mapping[str, Array]]) -> dict[str, Array]:
    """Return arrays by name, each along the members of all parts."""
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
