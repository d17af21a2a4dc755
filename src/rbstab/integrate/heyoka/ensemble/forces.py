"""Λ and v' along many trajectories. Traces contain them; summaries do not need them."""

from typing import NamedTuple

import heyoka as hy
import numpy as np

from rbstab.integrate.heyoka.compiled_map import lanes_of
from rbstab.integrate.heyoka.ensemble.ensemble import Ensemble
from rbstab.integrate.heyoka.ensemble.trajectories import EnsembleTrajectories
from rbstab.mechanics.numbers import Array
from rbstab.systems.system import LYAPUNOV_CHANGE


class ForcesAlong(NamedTuple):
    """Λ, shape (3, k, n), N, inertial, and v', shape (k, n), W, of k members at n samples."""

    contact_force: Array
    lyapunov_rate: Array


class EnsembleForces:
    """The compiled functions Λ and v' of a structure.

    Args:
        ensemble: The ensemble of the structure.
    """

    def __init__(self, ensemble: Ensemble) -> None:
        self.structure = ensemble.compiled
        system, y = self.structure.symbolic, self.structure.symbols
        force = system.observe(y[: system.size], hy.time).contact_force
        rate = system.audited_rates(y, hy.time)[LYAPUNOV_CHANGE]
        self.times = ensemble.times if self.structure.timed else None
        self.compiled = self.structure.function([*force, rate])

    def along(
        self, parameters: Array, trajectories: EnsembleTrajectories, rows: Array
    ) -> ForcesAlong:
        """Return Λ and v' of some members.

        Args:
            parameters: Shape (parameters, m).
            trajectories: The result of the ensemble's `run`.
            rows: The members, ascending, shape (k,), from 0 to m - 1.
        """
        count, (size, _, samples) = len(rows), trajectories.lanes.shape
        full = rows[lanes_of(count)]
        all_members = count == len(trajectories.steps)
        lanes = trajectories.lanes if all_members else np.take(trajectories.lanes, full, axis=1)
        chosen = self.structure.open_parameters(parameters, self.compiled)
        outputs = np.empty((4, len(full) * samples))
        time = {} if self.times is None else {"time": np.tile(self.times, len(full))}
        self.compiled(
            lanes.reshape(size, len(full) * samples),
            pars=np.repeat(chosen[:, full], samples, axis=1),
            outputs=outputs,
            **time,
        )
        force_and_rate = outputs.reshape(4, len(full), samples)[:, :count]
        return ForcesAlong(force_and_rate[:3], force_and_rate[3])
