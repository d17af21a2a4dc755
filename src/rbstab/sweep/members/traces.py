"""Traces: the stored trajectories of members."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.store.dataset import Motions
from rbstab.store.variables import RUN, Variable
from rbstab.sweep.members.outcome import element_states
from rbstab.sweep.plan.plan import Plan
from rbstab.systems.quantities import (
    BY_NAME,
    RUN_DIMENSIONS,
    Quantity,
    quantities_with,
    run_dimensions,
)

TIME = "time"


class TraceLayout(NamedTuple):
    """The layout of all traces of a plan.

    Args:
        times: The sample times, shape (n,), s.
        quantities: The quantities by name.
        lengths: The lengths of their dimensions.
    """

    times: Array
    quantities: dict[str, Quantity]
    lengths: dict[str, int]

    def shape(self, name: str) -> tuple[int, ...]:
        """Return the shape of a quantity of one member."""
        return tuple(self.lengths[dimension] for dimension in self.quantities[name].dimensions)

    @property
    def size(self) -> int:
        """The bytes of one trace."""
        numbers = sum(int(np.prod(self.shape(name))) for name in self.quantities)
        return numbers * np.dtype(float).itemsize

    def empty(self, members: int) -> dict[str, Array]:
        """Return traces of some members with all quantities NaN."""
        traces = {name: np.full((members, *self.shape(name)), np.nan) for name in self.quantities}
        return {TIME: self.times, **traces}

    def motions(self, traces: Mapping[str, Array], numbers: Array, plan_id: str) -> Motions:
        """Return the traces of a shard in the form in which they are stored.

        Args:
            traces: The traces by the names of their quantities.
            numbers: The numbers of their members.
            plan_id: The identity of the plan.
        """
        time = BY_NAME[TIME]
        variables = {
            RUN: Variable((RUN,), numbers, "1", "number of the run"),
            TIME: Variable((TIME,), traces[TIME], time.unit, time.long_name),
        }
        for name, quantity in self.quantities.items():
            for dimension in quantity.dimensions:
                components = np.arange(1, self.lengths[dimension] + 1)
                vector = Variable((dimension,), components, "1", "component of a vector")
                variables.setdefault(dimension, vector)
            dimensions, data = (RUN, *quantity.dimensions), traces[name]
            variables[name] = Variable(dimensions, data, quantity.unit, quantity.long_name)
        return Motions(variables, {"plan_id": plan_id})


def layout_of(plan: Plan) -> TraceLayout:
    """Return the layout of the traces of a plan, also for a plan without traces."""
    problems, states = plan.initial_value_problems.values(), element_states(plan)
    quantities = {
        name: quantity
        for name, quantity in quantities_with(states).items()
        if quantity.trace and any(quantity.exists_in(problem.system) for problem in problems)
    }
    times = next(iter(problems)).times
    lengths = RUN_DIMENSIONS | run_dimensions(states) | {TIME: len(times)}
    return TraceLayout(times, quantities, lengths)


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
