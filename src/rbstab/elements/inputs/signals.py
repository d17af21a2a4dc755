"""Signals: how the load of an input changes with time.

A signal is a number without a unit. Those that are smooth at all times are one formula. All others
are made of straight legs. Between two breakpoints a signal is one `Leg`, so its formula is smooth
there, and the engines begin the next leg at each breakpoint (`rbstab.systems.schedule`).
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from rbstab.elements.element import Element
from rbstab.mechanics.numbers import Array, Number, sin

PERIOD = 2.0 * np.pi


@dataclass(frozen=True, eq=False)
class Constant:
    """The signal s = 1."""

    timed: ClassVar[bool] = False

    def value(self, time: Number) -> Number:
        """Return 1."""
        return 1.0


@dataclass(frozen=True, eq=False)
class Sine:
    """The signal s = sin(2πft + φ).

    Args:
        frequency: f, Hz.
        phase: φ, rad.
    """

    timed: ClassVar[bool] = True

    frequency: Number
    phase: Number

    def value(self, time: Number) -> Number:
        """Return sin(2πft + φ)."""
        return _sine(PERIOD * self.frequency * time + self.phase)


@dataclass(frozen=True, eq=False)
class Leg:
    """The signal s = a + b(t - t_k): one leg of a signal of straight legs.

    Args:
        level: a, the signal at t_k.
        slope: b, 1/s.
        begin: t_k, s.
    """

    timed: ClassVar[bool] = True

    level: Number
    slope: Number
    begin: Number

    def value(self, time: Number) -> Number:
        """Return a + b(t - t_k)."""
        return self.level + self.slope * (time - self.begin)


Signal = Constant | Sine | Leg


@dataclass(frozen=True, eq=False, kw_only=True)
class Driven(Element):
    """An element whose statements depend on a signal.

    Args:
        signal: s.
    """

    signal: Signal

    @property
    def timed(self) -> bool:
        """Whether the signal changes with time."""
        return self.signal.timed


def _sine(angle: Number) -> Number:
    """Return the sine of one number of any kind."""
    entries: Array = np.array([angle])
    return sin(entries)[0]
