"""Λ and v' along many motions: what their traces show, and their summaries do not need."""

import heyoka as hy
import numpy as np

from rbstab.integrate.heyoka.ensemble import Ensemble, Motions
from rbstab.mechanics.numbers import Array


class EnsembleForces:
    """The compiled contact force and derivative of v of a structure.

    Args:
        ensemble: That of the structure.
    """

    def __init__(self, ensemble: Ensemble) -> None:
        system, y = ensemble.symbolic, ensemble.symbols
        force = system.observe(y[: system.size]).contact_force
        rate = system.audited_rates(y)[system.size]
        entries = [hy.expression(0.0) + entry for entry in (*force.tolist(), rate)]
        self.open, self.batch = ensemble.open, ensemble.batch
        self.compiled = hy.cfunc(entries, vars=list(y[: system.size]))

    def along(self, parameters: Array, motions: Motions, rows: Array) -> Array:
        """Λ and v' of some members, shape (4, k, n).

        Args:
            parameters: Shape (parameters, m).
            motions: What the ensemble's `run` returned.
            rows: Which members, ascending, shape (k,), from 0 to m - 1.
        """
        count, (size, _, samples) = len(rows), motions.lanes.shape
        # Whole batches are whole vectors of the processor; see `evaluated`.
        full = rows[np.minimum(np.arange(-(-count // self.batch) * self.batch), count - 1)]
        everyone = count == len(motions.steps)
        lanes = motions.lanes if everyone else np.take(motions.lanes, full, axis=1)
        chosen = parameters[self.open][: self.compiled.nparams]
        found = np.empty((4, len(full) * samples))
        self.compiled(
            lanes.reshape(size, len(full) * samples),
            pars=np.repeat(chosen[:, full], samples, axis=1),
            outputs=found,
        )
        return found.reshape(4, len(full), samples)[:, :count]
