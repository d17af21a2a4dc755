"""Integration of members in batches over samples; see `Batches`."""

from io import BytesIO
from typing import Any, NamedTuple

import heyoka as hy
import numpy as np

from rbstab.integrate.heyoka.compiled_map import SIMD, lanes_of
from rbstab.integrate.heyoka.ensemble.batch_grid import BatchGrid
from rbstab.integrate.heyoka.ensemble.compiled import CompiledStructure
from rbstab.integrate.heyoka.ensemble.reused_memory import ReusedMemory
from rbstab.mechanics.numbers import Array

MAX_STEPS = 20_000
"""The maximum number of steps of a batch."""

GRID_COMPLETED = hy.taylor_outcome.time_limit
"""heyoka's name for the end of the grid."""


class Lanes(NamedTuple):
    """Inputs and outputs of a run. The lanes are the last axis.

    In `states` they are the middle one. `ends` has, for each member, the times and the audited
    states at the ends of its steps, shape (1 + states, ends).
    """

    parameters: Array
    starts: Array
    states: Array
    ends: list[Array]
    steps: Array
    done: Array
    grid: BatchGrid


class Batches:
    """Integrates members of a structure, one batch after the other.

    Each lane of a batch has its own parameters, state and steps. Its result does not depend on the
    other lanes, to the last bit.

    Args:
        compiled: The structure.
        times: The samples, shape (n,), s.

    Attributes:
        grid: The samples.
        first_and_last: The first and the last one.
    """

    def __init__(self, compiled: CompiledStructure, times: Array) -> None:
        self._compiled = compiled
        self._integrator = compiled.integrator
        # Views of the integrator's memory: getting them takes as long as a step.
        self._pars, self._state = self._integrator.pars, self._integrator.state
        self._views = [memoryview(view).cast("B") for view in (self._integrator.time, self._state)]
        self._ends = BytesIO()
        self._memory = ReusedMemory()
        self.grid = BatchGrid.of(times, SIMD)
        self.first_and_last = BatchGrid.of(times[[0, -1]], SIMD)

    def run(
        self,
        parameters: Array,
        starts: Array,
        scales: Array,
        *,
        sampled: bool,
        reuse: bool = True,
    ) -> Lanes:
        """Integrate members.

        Args:
            parameters: Shape (parameters, m).
            starts: The initial states, shape (states, m).
            scales: The energy scales, shape (m,), J.
            sampled: Whether the states are evaluated at all samples, or only at the first and the
                last one.
            reuse: Whether the memory of the states is used again by the next call.
        """
        compiled, members = self._compiled, starts.shape[1]
        full = lanes_of(members)
        grid = self.grid if sampled else self.first_and_last
        shape = (compiled.audited_size, len(full), len(grid))
        audits = np.zeros((compiled.audited_size - compiled.size, members))
        pars = np.vstack([parameters[compiled.open_indices], scales])
        lanes = Lanes(
            # heyoka has no `par[]` after the last one that the equations use.
            pars[: len(self._pars), full],
            np.vstack([starts, audits])[:, full],
            self._memory.array("states", shape) if reuse else np.empty(shape),
            [np.empty(0)] * len(full),
            np.zeros(len(full), dtype=int),
            np.zeros(len(full), dtype=bool),
            grid,
        )
        for first in range(0, len(full), SIMD):
            self._integrate_batch(slice(first, first + SIMD), lanes)
        _check_finite(lanes)
        # One failing lane can stop the whole batch. So each unfinished member runs again, in a
        # batch that contains only this member.
        for lane in np.flatnonzero(~lanes.done[:members]).tolist():
            self._integrate_batch(slice(lane, lane + 1), lanes)
        _check_finite(lanes)
        return lanes

    def _integrate_batch(self, chosen: slice, lanes: Lanes) -> None:
        """Integrate one batch: members in all its lanes, or one member in every lane."""
        integrator = self._integrator
        integrator.set_time(lanes.grid.entries[0])
        self._pars[:] = lanes.parameters[:, chosen]
        self._state[:] = lanes.starts[:, chosen]
        self._ends.seek(0)
        self._write_end(integrator)
        _, found = integrator.propagate_grid(
            lanes.grid, max_steps=MAX_STEPS, callback=self._write_end
        )
        used = chosen.stop - chosen.start
        lanes.states[:, chosen] = found.transpose(1, 2, 0)[:, :used]
        outcomes = integrator.propagate_res[:used]
        lanes.steps[chosen] = steps = [taken for _, _, _, taken in outcomes]
        lanes.done[chosen] = [outcome == GRID_COMPLETED for outcome, _, _, _ in outcomes]
        size = self._ends.tell() // 8
        ends = np.frombuffer(self._ends.getbuffer(), count=size)
        ends = ends.reshape(-1, len(self._state) + 1, SIMD).transpose(1, 2, 0).copy()
        for lane, taken in enumerate(steps):
            lanes.ends[chosen.start + lane] = ends[:, lane, : taken + 1]

    def _write_end(self, _: Any) -> bool:
        """Keep the time and the state at the end of a step."""
        for view in self._views:
            self._ends.write(view)
        return True


def _check_finite(lanes: Lanes) -> None:
    """A state that became infinite or NaN stays so: the last sample is enough."""
    lanes.done[:] &= np.isfinite(lanes.states[..., -1]).all(axis=0)
