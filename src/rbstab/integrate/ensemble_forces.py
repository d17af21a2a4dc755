"""Λ and v' along many motions: what their traces show, and their summaries do not need."""

import heyoka as hy
import numpy as np

from rbstab.integrate.ensemble import Ensemble, Motions
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
        self.open = ensemble.open
        self.compiled = hy.cfunc(entries, vars=list(y[: system.size]))

    def along(self, parameters: Array, motions: Motions, rows: Array) -> Array:
        """Λ and v', shape (m, 4, n), of some members; what stands in all other rows is nothing.

        Args:
            parameters: Shape (parameters, m).
            motions: What the ensemble's `run` returned.
            rows: Numbers of members, from 0 to m - 1.
        """
        members, _, samples = motions.states.shape
        found = np.empty((members, 4, samples))
        chosen = parameters[self.open][: self.compiled.nparams]
        given = np.empty((len(chosen), samples))
        for row in rows.tolist():
            given[:] = chosen[:, row, np.newaxis]
            states = np.ascontiguousarray(motions.states[row])
            self.compiled(states, pars=given, outputs=found[row])
        return found
