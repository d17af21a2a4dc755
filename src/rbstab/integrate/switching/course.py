"""The course of a motion: the smooth equations that it follows one after another."""

from bisect import bisect_right
from typing import NamedTuple

from rbstab.systems.system import System


class Transition(NamedTuple):
    """A change of the equations at one time: by a switch, or at a breakpoint of an input.

    Attributes:
        time: The time, s.
        modes: The modes whose event functions have reached zero; none at a breakpoint.
        before: The system before it.
        after: The system after it.
        impact: Whether it is an impact, in which the state jumps.
    """

    time: float
    modes: tuple[int, ...]
    before: System
    after: System
    impact: bool = False


class Course(NamedTuple):
    """The systems of a motion, in their order.

    Attributes:
        first: The system at the start.
        transitions: What changes it, in the order of the times.
    """

    first: System
    transitions: tuple[Transition, ...] = ()

    @property
    def systems(self) -> tuple[System, ...]:
        """The systems, one more than there are transitions."""
        return self.first, *(transition.after for transition in self.transitions)

    def system_at(self, time: float) -> System:
        """Return the system at a time, s; that after a transition at its time."""
        number = bisect_right(self.transitions, time, key=lambda transition: transition.time)
        return self.transitions[number - 1].after if number else self.first
