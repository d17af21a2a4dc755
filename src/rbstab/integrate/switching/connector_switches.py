"""The axes of the connector of a sliding controller that switch: what is kept, and which stick."""

from typing import Any, NamedTuple

from rbstab.integrate.problem import Problem
from rbstab.integrate.switching.chatter import most_axes_stick
from rbstab.integrate.switching.records import SwitchRecord
from rbstab.mechanics.numbers import Array
from rbstab.systems.connector import connector_of
from rbstab.systems.modes import first_mode
from rbstab.systems.system import System

MIN_STICK_TEST_INTERVAL = 32
"""The minimum number of switches between two stick tests, because one test costs as much as many
switches."""

STICK_TEST_DIVISOR = 64
"""The number of switches between two stick tests grows to 1/64 of all switches so far."""


class ConnectorSwitches:
    """The switches of one run.

    Args:
        problem: The problem; its system has the connector by modes.
    """

    def __init__(self, problem: Problem) -> None:
        switching, system = problem.switching, problem.system
        assert switching is not None
        self.record = SwitchRecord(problem)
        self._first = first_mode(system, connector_of(system))
        self._modes = range(self._first, self._first + connector_of(system).mode_count)
        sticks = switching.sticks and connector_of(system).sticks
        self._stick_energy = switching.stick_energy if sticks else 0.0
        self._next_stick_test = 1

    def add_switches(self, modes: list[int], t: float) -> None:
        """Count the events among modes that are those of axes of the connector, at a time, s."""
        for axis in sorted(self._axes(modes)):
            self.record.add_switch(t, axis)

    def add_transitions(
        self, modes: list[int] | None, before: System | None, after: System, t: float
    ) -> None:
        """Keep the axes that stick or are released between two systems at one time.

        On s = E the release of an axis by the event of another one is a switch too. On s = F + κE
        it belongs to Filippov's choice at that event, which is one switch.

        Args:
            modes: The modes whose event functions have reached zero; None at a breakpoint, where a
                release is no switch.
            before: The system before; None at the start.
            after: The system after it.
            t: The time, s.
        """
        if before is after:
            return
        events = {0, 1, 2} if modes is None else self._axes(modes)
        held = [False] * 3 if before is None else _held(before)
        for axis, (was, now) in enumerate(zip(held, _held(after), strict=True)):
            if was != now:
                self.record.add_transition(t, axis, held=now)
                if was and axis not in events and connector_of(after).sticks:
                    self.record.add_switch(t, axis)

    def _axes(self, modes: list[int]) -> set[int]:
        """Return the axes of the connector to which some modes belong."""
        return {(mode - self._first) % 3 for mode in modes if mode in self._modes}

    def may_stick(self, y: Array, ahead: int = 0) -> bool:
        """Return whether a weak chatter may end by sticking, now or after `ahead` switches."""
        is_due = self._stick_energy > 0 and self.record.total + ahead >= self._next_stick_test
        return is_due and self.record.chatter.is_below(self._stick_energy, y)

    def stuck(
        self, modes: list[int], before: System, now: System, t: float, y: Array
    ) -> tuple[System, Array]:
        """Return the system and the state after a test whether a weak chatter ends by sticking.

        It is made where an axis has crossed, and none was released: its force is at the bound.

        Args:
            modes: The modes whose event functions have reached zero.
            before: The system before the switch.
            now: The system after it.
            t: The time, s.
            y: The audited state.
        """
        axes, was_held = self._axes(modes), _held(before)
        if not axes or any(was_held[axis] for axis in axes) or not self.may_stick(y):
            return now, y
        stick = self.test_sticking(now, t, y)
        if stick is None:
            return now, y
        self.record.discarded += stick.discarded
        for axis in stick.axes:
            self.record.add_switch(t, axis)
            self.record.add_transition(t, axis, held=True)
        self._schedule_stick_test()
        return stick.system, stick.state

    def test_sticking(self, system: System, t: float, y: Array) -> Any:
        """Return the axes that stick in a system; None if none does.

        Args:
            system: The system.
            t: The time, s.
            y: The audited state.
        """
        stick = most_axes_stick(system, y, t)
        if stick is None:
            self._schedule_stick_test()
        return stick

    def _schedule_stick_test(self) -> None:
        total = self.record.total
        self._next_stick_test = total + max(MIN_STICK_TEST_INTERVAL, total // STICK_TEST_DIVISOR)


class SoFar(NamedTuple):
    """The system in its current modes, and the switches of each axis of a connector so far."""

    system: System
    counts: tuple[int, ...]


def side_of_axes(system: System) -> Array:
    """Return the side of each axis of the connector, 0 for one that is held or in its layer."""
    side, _ = connector_of(system).side_and_layer()
    return side


def _held(system: System) -> list[bool]:
    connector: Any = connector_of(system)
    return (connector.held > 0).tolist() if connector.slides else [False] * 3
