"""The compiled equations of a structure for batches of members."""

from collections.abc import Iterable
from typing import Any

import heyoka as hy
import numpy as np

from rbstab.integrate.heyoka.compiled_map import SIMD
from rbstab.integrate.heyoka.symbols import (
    parameter_values,
    scaled_audit,
    state_symbols,
    symbols_of,
)
from rbstab.integrate.in_quaternions import in_quaternions
from rbstab.mechanics.numbers import Array
from rbstab.systems.coordinates import QuaternionCoordinates
from rbstab.systems.system import CONTACT_WORK, System

# Sweeps have their own threads. heyoka's own threads would only wait and use processor time.
hy.set_nthreads(1)


CHANGE_ROW = -1
"""The row of ∫v' dt in the states of a batch. ε, the audit state after it in a system, is left out:
no member in a batch has a law that needs it, and it takes a tenth of the time."""


class CompiledStructure:
    """The compiled audited equations of a structure, for one batch, and its symbols.

    The `par[]` of the integrator are the parameters that differ between members, and the energy
    scale.

    Args:
        system: Any system of the structure.
        tolerance: heyoka's tolerance.
        varies: Which parameters differ between members, shape (parameters,); by default all. The
            others are compiled in, with the values of `system`: zeros and products of constants
            then cost nothing.
        quaternion: Whether the integrator has a quaternion in place of Θ.

    Attributes:
        integrator: heyoka's batch integrator.
        symbolic: The system of symbols.
        symbols: The symbols of its state.
        moving: The one that is integrated: in quaternions, or the same.
        q: The coordinates with a quaternion that the integrator has; None if it has none.
        size: The number of states of the integrator.
        audited_size: The number of its audited states, without ε.
        timed: Whether its equations depend on the time.
        open_indices: The indices of the parameters that differ between members.
        audited_rates: The rates of its states, with those of the audit states in W.
        observation: What is observed of the symbolic system.
        energies: The expressions of its energies, J.
    """

    def __init__(
        self,
        system: System,
        tolerance: float,
        varies: Array | None = None,
        *,
        quaternion: bool = False,
    ) -> None:
        values = parameter_values(system)
        varies = np.ones(len(values), dtype=bool) if varies is None else varies
        symbol_indices = np.cumsum(varies) - 1
        self.open_indices = np.flatnonzero(varies)

        def symbol(index: int) -> Any:
            constant = hy.expression(float(values[index]))
            return hy.par[int(symbol_indices[index])] if varies[index] else constant

        symbolic, _, _ = symbols_of(system, symbol)
        self.symbolic, self.timed = symbolic, system.timed
        self.symbols = state_symbols(system.size)
        moving = symbolic
        self.q: QuaternionCoordinates | None = None
        if quaternion:
            moving, self.q = in_quaternions(symbolic)
        self.moving = moving
        self.size, self.audited_size = moving.size, moving.audited_size + CONTACT_WORK
        y = state_symbols(self.audited_size)
        scale = hy.par[len(self.open_indices)]
        self.audited_rates = moving.audited_rates(y, hy.time)[:CONTACT_WORK]
        rates = scaled_audit(self.audited_rates, self.size, scale)
        self.integrator = hy.taylor_adaptive_batch(
            list(zip(y, rates, strict=True)),
            state=np.zeros((len(y), SIMD)),
            tol=tolerance,
            # A member that ends there is not done, and so runs again alone.
            t_events=[hy.t_event_batch(event) for event in moving.clearances(y)],
        )
        self.observation = symbolic.observe(self.symbols)
        self.energies = [hy.expression(0.0) + entry for entry in self.observation.energy.tolist()]

    def function(self, entries: Iterable[Any], size: int | None = None) -> Any:
        """Return a compiled function of the state and the parameters that differ.

        Args:
            entries: Expressions, or numbers.
            size: The number of states; default that with Θ.
        """
        expressions = [hy.expression(0.0) + entry for entry in entries]
        symbols = self.symbols if size is None else state_symbols(size)
        return hy.cfunc(expressions, vars=list(symbols))

    def open_parameters(self, parameters: Array, compiled: Any) -> Array:
        """Return those of the parameters, shape (parameters, m), that a compiled function has."""
        return parameters[self.open_indices][: compiled.nparams]
