"""What is kept of a whole motion, where a plan keeps more than the summary."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from rbstab.config.build import problem_of
from rbstab.mechanics.numbers import Array
from rbstab.store.motions import Motions
from rbstab.store.result import Variable
from rbstab.store.table import AXES, RUN
from rbstab.sweep.plan.plan import Plan
from rbstab.sweep.plan.trace_selection import TraceSelection
from rbstab.systems.quantities import BY_NAME

TIME = "time"

OWN = "connector_state"
"""Kept where a variant has it."""

KEPT = (
    "orientation",
    "angular_velocity",
    "position",
    "velocity",
    OWN,
    "contact_displacement",
    "contact_velocity",
    "contact_force",
    "lyapunov",
    "lyapunov_rate",
    "lyapunov_change",
    "energy_residual",
)
"""The quantities of a trace, named as in the file of a single run."""


class TraceLayout(NamedTuple):
    """The samples of the traces of a plan, s, and the names of their quantities."""

    times: Array
    names: tuple[str, ...]

    def shape(self, name: str) -> tuple[int, ...]:
        """The shape of a quantity of one member."""
        return tuple(AXES if d == "axis" else len(self.times) for d in BY_NAME[name].dimensions)

    @property
    def size(self) -> int:
        """The bytes of one member."""
        numbers = sum(int(np.prod(self.shape(name))) for name in self.names)
        return numbers * np.dtype(float).itemsize

    def blank(self, members: int) -> dict[str, Array]:
        """Traces of which nothing is known."""
        found = {name: np.full((members, *self.shape(name)), np.nan) for name in self.names}
        return {TIME: self.times, **found}


def layout_of(plan: Plan) -> TraceLayout:
    """The layout of the traces of a plan, whether it keeps any or not."""
    problems = [problem_of(base) for base in plan.bases.values()]
    has_own = any(p.system.size > p.system.coordinates.size for p in problems)
    return TraceLayout(problems[0].times, tuple(n for n in KEPT if n != OWN or has_own))


def put(
    target: Mapping[str, Array], places: Array, source: Mapping[str, Array | None], rows: Array
) -> None:
    """Copies traces: rows of the source to places of the target, in all that the source has."""
    to, of = _slice(places), _slice(rows)
    for name, data in source.items():
        if data is None:
            continue
        if data.ndim == 2:
            target[name][to] = data[of]
            continue
        # By component: what batches compute stands by components, and is long along the samples.
        for axis in range(AXES):
            target[name][to, :, axis] = data[of, :, axis]


def put_single(target: Mapping[str, Array], place: int, quantities: Mapping[str, Array]) -> None:
    """Copies the motion of a single run, as far as it reached the samples."""
    times, samples = quantities[TIME], target[TIME]
    count = min(len(times), len(samples))
    alike = times[:count] == samples[:count]
    # Behind its last sample, a run that stopped early has the state of the stop, which is none.
    reached = count if alike.all() else int(alike.argmin())
    for name in target:
        if name != TIME and name in quantities:
            target[name][place, :reached] = quantities[name][:reached]


def checked_traces(
    traces: dict[str, Array] | None, plan: Plan, start: int, stop: int
) -> dict[str, Array] | None:
    """The traces of a shard in their types; None where it has to have none.

    Raises:
        ValueError: One is missing, or has not an entry for each member that has a trace.
    """
    members = int(plan.keep.traces(start, stop).sum())
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
    traces: Mapping[str, Array], keep: TraceSelection, start: int, stop: int, plan_id: str
) -> Motions:
    """The traces of a shard as they are stored."""

    def stored(name: str, data: Array) -> Variable:
        quantity = BY_NAME[name]
        along = () if name == TIME else (RUN,)
        what = f"{quantity.symbol}: {quantity.meaning}"
        return Variable((*along, *quantity.dimensions), data, quantity.unit, what)

    numbers = start + np.flatnonzero(keep.traces(start, stop))
    coordinates = {
        RUN: Variable((RUN,), numbers, "1", "number of the run"),
        "axis": Variable(("axis",), np.arange(1, AXES + 1), "1", "component of a vector"),
    }
    described = {name: stored(name, data) for name, data in traces.items()}
    return Motions(coordinates | described, {"plan_id": plan_id})


def _slice(indices: Array) -> Array | slice:
    """Ascending indices, as a slice where they follow each other: that copies nothing twice."""
    if len(indices) and indices[-1] - indices[0] == len(indices) - 1:
        return slice(int(indices[0]), int(indices[-1]) + 1)
    return indices
