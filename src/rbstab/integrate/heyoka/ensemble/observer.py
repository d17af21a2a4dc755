"""What is observed of the members of an ensemble at their samples."""

import numpy as np

from rbstab.integrate.heyoka.ensemble.compiled import CompiledStructure
from rbstab.integrate.heyoka.ensemble.reused_memory import ReusedMemory
from rbstab.integrate.heyoka.ensemble.trajectories import (
    EnsembleTrajectories,
    ObservedPositions,
    ObservedTrajectories,
)
from rbstab.mechanics.numbers import Array

OBSERVED_SIZE = 4 * 3 + 1
"""The number of values of `ObservedTrajectories` at one sample."""


class EnsembleObserver:
    """The compiled observed quantities of a structure.

    Args:
        compiled: The structure.
    """

    def __init__(self, compiled: CompiledStructure) -> None:
        self._compiled = compiled
        self._memory = ReusedMemory()
        motion = compiled.observation.motion
        along = [motion.E, motion.Theta, motion.F, motion.B @ motion.Omega]
        self._observed = compiled.function([*np.concatenate(along), sum(compiled.energies)])
        self._positions = compiled.function([*motion.X, *motion.V])

    def observe(
        self, parameters: Array, trajectories: EnsembleTrajectories
    ) -> ObservedTrajectories:
        """Return the observed quantities at the samples of a run, valid until the next such call.

        Args:
            parameters: Shape (parameters, m).
            trajectories: The result of `Ensemble.run`.
        """
        # Complete batches are complete SIMD vectors; see `lanes_of`.
        size, full, samples = trajectories.lanes.shape
        shape = (OBSERVED_SIZE, full * samples)
        found = self._memory.array("observed", shape)
        chosen = self._compiled.open_parameters(parameters, self._observed)
        self._observed(
            trajectories.lanes.reshape(size, full * samples),
            pars=self._repeat_for_samples(chosen, full, samples),
            outputs=found,
        )
        rows = found.reshape(OBSERVED_SIZE, full, samples)[:, : len(trajectories.steps)]
        return ObservedTrajectories(rows[:6], rows[6:12], rows[12])

    def positions(
        self, parameters: Array, trajectories: EnsembleTrajectories, *, only_last: bool
    ) -> ObservedPositions:
        """Return X and V at all samples of a run, or only at the last one (n = 1).

        Args:
            parameters: Shape (parameters, m).
            trajectories: The result of `Ensemble.run`.
            only_last: Whether the other samples are left out.
        """
        lanes = trajectories.lanes[..., -1:] if only_last else trajectories.lanes
        size, full, samples = lanes.shape
        chosen = self._compiled.open_parameters(parameters, self._positions)
        found = self._positions(
            np.ascontiguousarray(lanes.reshape(size, full * samples)),
            pars=self._repeat_for_samples(chosen, full, samples),
        )
        rows = found.reshape(6, full, samples)[:, : len(trajectories.steps)]
        return ObservedPositions(rows[:3], rows[3:])

    def _repeat_for_samples(self, chosen: Array, full: int, samples: int) -> Array:
        """Repeat the parameters of each member for each of its samples."""
        found = self._memory.array("parameters", (len(chosen), full, samples))
        found[:, : chosen.shape[1]] = chosen[:, :, np.newaxis]
        found[:, chosen.shape[1] :] = chosen[:, -1:, np.newaxis]
        return found.reshape(len(chosen), full * samples)
