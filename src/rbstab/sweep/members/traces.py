"""Traces: the stored trajectories of members."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from rbstab.elements.declarations import OwnState
from rbstab.mechanics.numbers import Array
from rbstab.store.motions import Motions
from rbstab.store.variables import RUN, Variable
from rbstab.sweep.members.outcome import element_states
from rbstab.sweep.plan.plan import Plan
from rbstab.systems.quantities import (
    BY_NAME,
    RUN_DIMENSIONS,
    quantities_with,
    run_dimensions,
    state_quantity,
)

TIME = "time"


class TraceLayout(NamedTuple):
    """The layout of all traces of a plan.

    Args:
        times: The sample times, shape (n,), s.
        names: The names of the quantities.
        states: The own states of named elements.
    """

    times: Array
    names: tuple[str, ...]
    states: tuple[OwnState, ...] = ()

    def shape(self, name: str) -> tuple[int, ...]:
        """Return the shape of a quantity of one member."""
        lengths = RUN_DIMENSIONS | run_dimensions(self.states) | {TIME: len(self.times)}
        quantity = quantities_with(self.states)[name]
        return tuple(lengths[dimension] for dimension in quantity.dimensions)

    @property
    def size(self) -> int:
        """The bytes of one trace."""
        numbers = sum(int(np.prod(self.shape(name))) for name in self.names)
        return numbers * np.dtype(float).itemsize

    def empty(self, members: int) -> dict[str, Array]:
        """Return traces of some members with all quantities NaN."""
        found = {name: np.full((members, *self.shape(name)), np.nan) for name in self.names}
        return {TIME: self.times, **found}


def layout_of(plan: Plan) -> TraceLayout:
    """Return the layout of the traces of a plan, also for a plan without traces."""
    systems = [problem.system for problem in plan.initial_value_problems.values()]
    times = next(iter(plan.initial_value_problems.values())).times
    states = element_states(plan)
    names = [
        name
        for name, quantity in (BY_NAME | {one.name: state_quantity(one) for one in states}).items()
        if quantity.trace and any(map(quantity.exists_in, systems))
    ]
    return TraceLayout(times, tuple(names), states)


def copy_single_run(target: Mapping[str, Array], row: int, quantities: Mapping[str, Array]) -> None:
    """Copy the trajectory of a single run, up to the last sample that it reached.

    Args:
        target: The traces to write to.
        row: The row to write.
        quantities: The trajectory of the single run, with its times.
    """
    times, samples = quantities[TIME], target[TIME]
    count = min(len(times), len(samples))
    alike = times[:count] == samples[:count]
    # A run that stopped early ends with its state at the stop, which is not a sample.
    reached = count if alike.all() else int(alike.argmin())
    for name in target:
        if name != TIME and name in quantities:
            target[name][row, :reached] = quantities[name][:reached]


def checked_traces(
    traces: dict[str, Array] | None, plan: Plan, start: int, stop: int
) -> dict[str, Array] | None:
    """Check and return the traces of a shard as floats; None if the plan selects no member of it.

    Args:
        traces: The traces from the engine.
        plan: The plan.
        start: The first member.
        stop: One after the last member, as in `range`.

    Raises:
        ValueError: A quantity is missing, or does not have one entry for each selected member.
    """
    members = int(plan.keep.selected(start, stop).sum())
    if not members:
        return None
    layout = layout_of(plan)
    found = {TIME: layout.times}
    for name in layout.names:
        data = np.asarray((traces or {}).get(name))
        if data.shape != (members, *layout.shape(name)):
            raise ValueError(f"{name} has the shape {data.shape} for {members} traces")
        found[name] = data.astype(float, copy=False)
    return found


def motions_of(
    traces: Mapping[str, Array], numbers: Array, plan_id: str, states: Sequence[OwnState]
) -> Motions:
    """Return the traces of a shard in the form in which they are stored.

    Args:
        traces: The traces by the names of their quantities.
        numbers: The numbers of their members.
        plan_id: The identity of the plan.
        states: The own states of named elements.
    """
    quantities, lengths = quantities_with(states), RUN_DIMENSIONS | run_dimensions(states)

    def stored(name: str, data: Array) -> Variable:
        quantity = quantities[name]
        along = () if name == TIME else (RUN,)
        return Variable((*along, *quantity.dimensions), data, quantity.unit, quantity.long_name)

    coordinates = {
        RUN: Variable((RUN,), numbers, "1", "number of the run"),
        **{
            name: Variable((name,), np.arange(1, length + 1), "1", "component of a vector")
            for name, length in lengths.items()
            if any(name in quantities[array].dimensions for array in traces)
        },
    }
    described = {name: stored(name, data) for name, data in traces.items()}
    return Motions(coordinates | described, {"plan_id": plan_id})
