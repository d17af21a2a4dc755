"""Integration of members in batches over samples; see `Batches`."""

from typing import NamedTuple

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

    In `states` and in those of the divided first interval they are the middle one.
    """

    parameters: Array
    starts: Array
    states: Array
    first: Array
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
        parts: The parts of the first interval between samples.

    Attributes:
        grid: The samples, with those that divide the first interval.
    """

    def __init__(self, compiled: CompiledStructure, times: Array, parts: int) -> None:
        self._compiled = compiled
        self._integrator = compiled.integrator
        # Views of the integrator's memory: getting them takes as long as a step.
        self._pars, self._state = self._integrator.pars, self._integrator.state
        self._memory = ReusedMemory()
        first = np.linspace(times[0], times[1], parts + 1)
        self.parts = parts
        self.grid = BatchGrid.of(np.concatenate([first[:-1], times[1:]]), SIMD)

    def run(  # noqa: PLR0913 (all that a run depends on)
        self,
        parameters: Array,
        starts: Array,
        scales: Array,
        times: Array | None,
        begin: Array,
        *,
        reuse: bool = True,
    ) -> Lanes:
        """Integrate members.

        Args:
            parameters: Shape (parameters, m).
            starts: The initial states, shape (states, m).
            scales: The energy scales, shape (m,), J.
            times: Other samples, shape (n,), s; None for those of the batches.
            begin: The time of the start of each member, shape (m,), s.
            reuse: Whether the memory of the states is used again by the next call, if the samples
                are those of the batches.
        """
        compiled, members = self._compiled, starts.shape[1]
        full = lanes_of(members)
        grid = self.grid if times is None else BatchGrid.of(times, SIMD)
        parts = self.parts if times is None else 1
        shape = (compiled.audited_size, len(full), len(grid) - parts + 1)
        audits = np.zeros((compiled.audited_size - compiled.size, members))
        pars = np.vstack([parameters[compiled.open_indices], scales, begin])
        lanes = Lanes(
            # heyoka has no `par[]` after the last one that the equations use.
            pars[: len(self._pars), full],
            np.vstack([starts, audits])[:, full],
            self._memory.array("states", shape) if times is None and reuse else np.empty(shape),
            np.empty((compiled.audited_size, len(full), parts + 1)),
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
        _, found = integrator.propagate_grid(lanes.grid, max_steps=MAX_STEPS)
        used = chosen.stop - chosen.start
        sampled = found.transpose(1, 2, 0)[:, :used]
        parts = lanes.first.shape[2] - 1
        lanes.states[:, chosen, 1:] = sampled[..., parts:]
        lanes.states[:, chosen, 0] = sampled[..., 0]
        if parts > 1:
            lanes.first[:, chosen] = sampled[..., : parts + 1]
        outcomes = integrator.propagate_res[:used]
        lanes.steps[chosen] = [taken for _, _, _, taken in outcomes]
        lanes.done[chosen] = [outcome == GRID_COMPLETED for outcome, _, _, _ in outcomes]


def _check_finite(lanes: Lanes) -> None:
    """A state that became infinite or NaN stays so: the last sample is enough."""
    lanes.done[:] &= np.isfinite(lanes.states[..., -1]).all(axis=0)
