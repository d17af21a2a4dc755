"""The switches of the connector of a sliding controller, whose modes the driver of modes follows.

An event of an axis is a switch, and a change of its hold is a stick or a release.
"""

from typing import Any

import numpy as np

from rbstab.elements.sliding_ties import AtContact
from rbstab.integrate.problem import Problem, Switching
from rbstab.integrate.switch_trace import StickSlip, SwitchTrace
from rbstab.integrate.switching.chatter import Chatter, Stick, most_axes_stick
from rbstab.integrate.switching.switch_log import SwitchLog
from rbstab.mechanics.numbers import Array
from rbstab.systems.modes import modes_of, with_modes
from rbstab.systems.system import System

Stuck = tuple[System, Array]
"""A system and an audited state."""


class ConnectorSwitches:
    """The switches of one run.

    Args:
        problem: The problem; its system has the connector by modes.
        switching: The rules for its modes.
    """

    def __init__(self, problem: Problem, switching: Switching) -> None:
        self._diagnosed = problem.diagnosed
        self._first, self._count = _places(problem.system)
        self._log = SwitchLog(switching.stored_switches, switching.switch_limit)
        sticks = switching.sticks and _connector(problem.system).sticks
        self._stick_energy = switching.stick_energy if sticks else 0.0
        self._discarded = 0.0
        self._chatter = Chatter(problem.system)
        self._samples: list[tuple[Array, tuple[int, ...], float, float]] = []

    def begin(self, system: System, t: float) -> None:
        """Store the axes that are held at the start, s, as axes that stick there."""
        for axis, held in enumerate(_held(system)):
            if held:
                self._log.add_transition(t, axis, StickSlip.STICK)

    def add_events(self, modes: list[int], t: float) -> None:
        """Count the events among modes that are those of axes of the connector.

        Args:
            modes: The modes whose event functions have reached zero.
            t: The time, s.
        """
        for axis in sorted(self._axes(modes)):
            self._log.add_switch(t, axis)

    def add_event(self, mode: int, t: float) -> None:
        """Count the event of one mode, if it is one of the connector; see `add_events`."""
        if self._first <= mode < self._first + self._count:
            self._log.add_switch(t, (mode - self._first) % 3)

    def may_stick(self, y: Array) -> bool:
        """Return whether a weak chatter may end by sticking at the next switch (`stuck`)."""
        is_due = self._stick_energy > 0 and self._log.total + 1 >= self._log.next_stick_test
        return is_due and self._chatter.is_below(self._stick_energy, y)

    @property
    def counts(self) -> tuple[int, ...]:
        """The switches of each axis so far."""
        return tuple(self._log.counts)

    def add_transitions(
        self, modes: list[int] | None, before: System, after: System, t: float
    ) -> None:
        """Store the axes that stick or are released between two systems at one time.

        On s = E the release of an axis by the event of another one is a switch too. On s = F + κE
        it belongs to Filippov's choice at that event, which is one switch.

        Args:
            modes: The modes whose event functions have reached zero; None at a breakpoint, where a
                release is no switch.
            before: The system before.
            after: The system after it.
            t: The time, s.
        """
        if before is after:
            return
        events = {0, 1, 2} if modes is None else self._axes(modes)
        held, sticks = zip(_held(before), _held(after), strict=True), _connector(after).sticks
        for axis, (was, now) in enumerate(held):
            if was != now:
                kind = StickSlip.STICK if now else StickSlip.RELEASE
                self._log.add_transition(t, axis, kind)
                if was and axis not in events and sticks:
                    self._log.add_switch(t, axis)

    def _axes(self, modes: list[int]) -> set[int]:
        """Return the axes of the connector to which some modes belong."""
        places = range(self._first, self._first + self._count)
        return {(mode - self._first) % 3 for mode in modes if mode in places}

    def stuck(self, modes: list[int], before: System, now: System, t: float, y: Array) -> Stuck:
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
        is_due = self._stick_energy > 0 and self._log.total >= self._log.next_stick_test
        if not (is_due and axes) or any(was_held[axis] for axis in axes):
            return now, y
        if not self._chatter.is_below(self._stick_energy, y):
            return now, y
        found = self._most_axes_stick(now, t, y)
        if found is None:
            return now, y
        self._discarded += found.discarded
        self._log.add_sticks(t, found.axes)
        self._log.schedule_stick_test()
        return found.system, found.state

    def would_stick(self, system: System, t: float, y: Array) -> bool:
        """Return whether an axis may stick in a system, at a time, s, and a state."""
        return self._most_axes_stick(system, t, y) is not None

    def _most_axes_stick(self, system: System, t: float, y: Array) -> Stick | None:
        held = np.flatnonzero(_held(system)).tolist()
        found = most_axes_stick(system, y, held, lambda more: self._with_held(system, more), t)
        if found is None:
            self._log.schedule_stick_test()
        return found

    def _with_held(self, system: System, axes: tuple[int, ...]) -> System:
        """Return a system in which some axes of the connector are held."""
        modes = np.array(modes_of(system))
        for axis in axes:
            modes[[self._first + axis, self._first + 3 + axis]] = 1.0
        return with_modes(system, tuple(modes.tolist()))

    def add_sample(self, system: System, y: Array, counts: tuple[int, ...]) -> None:
        """Store the modes and the switches so far as those of a sample.

        Args:
            system: The system in the modes of the sample.
            y: The state.
            counts: The switches of each axis so far.
        """
        side, _ = _connector(system).side_and_layer()
        energy = self._chatter.energy(y) if self._diagnosed else np.nan
        self._samples.append((side, counts, energy, self._discarded))

    def repeat_sample(self, system: System, counts: tuple[int, ...], y: Array) -> None:
        """Store the last sample again, after a breakpoint at its time."""
        self._samples.pop()
        self.add_sample(system, y, counts)

    def trace(self) -> SwitchTrace:
        """Return the switches of the samples so far, without `trusted_until`."""
        modes, counts, energies, discarded = zip(*self._samples, strict=True)
        return SwitchTrace(
            modes=np.array(modes),
            counts=np.array(counts),
            chatter_energy=np.array(energies),
            discarded_energy=np.array(discarded),
            switch_times=np.array(self._log.times),
            switch_axes=np.array(self._log.axes, dtype=int),
            transitions=self._log.transitions,
            trusted_until=np.nan,
        )


def _connector(system: System) -> Any:
    return next(element for element in system.elements if isinstance(element, AtContact))


def _held(system: System) -> list[bool]:
    connector = _connector(system)
    return (connector.held > 0).tolist() if connector.slides else [False] * 3


def _places(system: System) -> tuple[int, int]:
    """Return the index of the first mode of the connector, and how many it has."""
    begin = 0
    for element in system.elements:
        if isinstance(element, AtContact):
            return begin, element.mode_count
        begin += element.mode_count
    raise ValueError("the system has no connector with modes")
