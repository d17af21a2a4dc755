"""The rates of a system as SciPy's integrators call them, which can end a run at any call."""

from collections.abc import Callable
from copy import copy
from dataclasses import dataclass

import numpy as np

from rbstab.integrate.deadline import Deadline
from rbstab.integrate.status import RunStatus, StopRun
from rbstab.integrate.straight_line.equations import StraightLine
from rbstab.mechanics.derivatives import jacobian
from rbstab.mechanics.numbers import Array
from rbstab.systems.system import System

MAX_NON_FINITE_IN_A_ROW = 1000
"""A run stops after this many evaluations in a row without finite rates. A step that shrinks from
1 s to round-off makes about 300."""


class EquationsInTime:
    """Equations of a system, as a function of the audited state and the time.

    Args:
        equations: A function of a system, an audited state and a time.
        system: The system.
        timed: Whether they depend on the time; default: whether the system does.
        size: The length of the state; default that of the audited one.
    """

    def __init__(
        self,
        equations: Callable[..., Array],
        system: System,
        timed: bool | None = None,
        size: int | None = None,
    ) -> None:
        self._timed = system.timed if timed is None else timed
        size = system.audited_size if size is None else size
        # The time is one more variable, but only of equations that depend on it.
        self._of = (
            StraightLine(_WithTime(equations), system, size + 1)
            if self._timed
            else StraightLine(equations, system, size)
        )
        self._finite_value = self._of.finite_value

    @property
    def of_state(self) -> StraightLine | None:
        """The same equations as a function of the state alone; None if they depend on the time."""
        return None if self._timed else self._of

    def __call__(self, y: Array, t: complex = 0.0) -> Array:
        """Return the value at an audited state of floats or complex numbers."""
        return self._of(np.append(y, t) if self._timed else y)

    def finite_value(self, y: Array, t: float = 0.0) -> Array | None:
        """Return the value; None if it or y is not finite, or if there is no code for it."""
        return self._finite_value(np.append(y, t) if self._timed else y)

    def by_numpy(self, y: Array, t: float = 0.0) -> Array:
        """Return the value as numpy evaluates it."""
        return self._of.by_numpy(np.append(y, t) if self._timed else y)

    def in_modes_of(self, system: System) -> "EquationsInTime":
        """Return the equations of a system that differs from this one in its modes alone."""
        other = copy(self)
        other._of = self._of.in_modes_of(system)
        other._finite_value = other._of.finite_value
        return other


@dataclass(frozen=True)
class _WithTime:
    """Equations of a system as a function of one vector: the audited state, then the time."""

    equations: Callable[..., Array]

    def __call__(self, system: System, variables: Array) -> Array:
        """Return the value of the equations."""
        return self.equations(system, variables[:-1], variables[-1])


def audited_rates_of(system: System) -> EquationsInTime:
    """Return the audited rates of a system, as a function of the audited state and the time."""
    return EquationsInTime(System.audited_rates, system)


class WatchedRates:
    """The audited rates of a system, as a function of time and state.

    SciPy can repeat a step for ever. So the deadline is checked at every evaluation.

    Args:
        audited_rates: The rates; those of another system may be set between two steps.
        deadline: The deadline of the run.

    Attributes:
        evaluations: Evaluations so far.
        non_finite_count: How many of the last evaluations in a row were not finite.
    """

    def __init__(self, audited_rates: EquationsInTime, deadline: Deadline) -> None:
        self.audited_rates = audited_rates
        self.evaluations = 0
        self.non_finite_count = 0
        self._deadline = deadline

    def __call__(self, t: float, y: Array) -> Array:
        """Return the rates.

        Raises:
            StopRun: The deadline has expired, or the rates stopped being finite.
        """
        self.evaluations += 1
        self._check_deadline()
        rates = self.audited_rates.finite_value(y, t)
        if rates is not None:
            self.non_finite_count = 0
            return rates
        rates = self.audited_rates.by_numpy(y, t)
        self.non_finite_count = 0 if np.isfinite(rates).all() else self.non_finite_count + 1
        if self.non_finite_count > MAX_NON_FINITE_IN_A_ROW:
            raise StopRun(RunStatus.DIVERGED, "the rates stopped being finite")
        return rates

    def jacobian(self, t: float, y: Array) -> Array:
        """Return the Jacobian of the rates, for implicit methods; errors as for the rates."""
        self.evaluations += len(y)
        self._check_deadline()
        return jacobian(lambda z: self.audited_rates(z, t), y)

    def _check_deadline(self) -> None:
        if self._deadline.expired():
            raise StopRun(RunStatus.TIME_LIMIT, self._deadline.reason)
