"""The energy scales of members: heyoka's error is relative to the largest state, scaled by them."""

import numpy as np

from rbstab.integrate.heyoka.compiled_map import evaluate_compiled
from rbstab.integrate.heyoka.ensemble.compiled import CompiledStructure
from rbstab.integrate.heyoka.symbols import LARGEST_MISFIT
from rbstab.mechanics.numbers import Array


class EnergyScales:
    """The compiled energies of a structure.

    Args:
        compiled: The structure.
    """

    def __init__(self, compiled: CompiledStructure) -> None:
        self._compiled = compiled
        self._energies = compiled.function(compiled.energies)

    def at_start(self, parameters: Array, starts: Array) -> Array:
        """Return the energy scale of each member at its start, shape (m,), J.

        It is 1 J if the energies are zero or not finite.

        Args:
            parameters: Shape (parameters, m), in the order of `parameter_values`.
            starts: Shape (states, m).
        """
        size = self._sizes_at_start(parameters, starts)
        return np.where((size > 0) & (size < np.inf), size, 1.0)

    def fitting(self, parameters: Array, starts: Array, scales: Array, audits: Array) -> Array:
        """Return the energy scales that fit runs, shape (m,), J; the given ones if those fit.

        See `symbols.fitting_scale`.

        Args:
            parameters: Shape (parameters, m).
            starts: Shape (states, m).
            scales: The scales of the runs, shape (m,), J.
            audits: The largest audit state of each run, in units of its scale, shape (m,).
        """
        sizes = self._sizes_at_start(parameters, starts) + audits * scales
        misfits = (sizes > LARGEST_MISFIT * scales) | (sizes < scales / LARGEST_MISFIT)
        return np.where(misfits & (sizes > 0) & np.isfinite(sizes), sizes, scales)

    def energies(self, parameters: Array, states: Array) -> Array:
        """Return the energy of each part of each member at a state, shape (parts, m), J."""
        chosen = self._compiled.open_parameters(parameters, self._energies)
        return np.asarray(evaluate_compiled(self._energies, states, chosen))

    def _sizes_at_start(self, parameters: Array, starts: Array) -> Array:
        """Return the sum of the absolute energies of each member at its start, shape (m,), J."""
        with np.errstate(all="ignore"):
            return np.asarray(np.abs(self.energies(parameters, starts)).sum(axis=0))
