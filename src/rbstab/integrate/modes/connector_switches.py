"""The switches of the connector of a sliding controller, whose modes the driver of modes follows.

They are stored as those of the driver in `integrate.switching`: an event of an axis is a switch,
and a change of its hold is a stick or a release.
"""

from typing import Any

import numpy as np

from rbstab.elements.sliding_ties import AtContact
from rbstab.integrate.problem import Problem, Switching
from rbstab.integrate.switch_trace import SwitchTrace, Transition
from rbstab.integrate.switching.chatter import chatter_energy
from rbstab.integrate.switching.switch_log import SwitchLog
from rbstab.mechanics.numbers import Array
from rbstab.mechanics.states import BODY
from rbstab.systems.system import System


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
        self._samples: list[tuple[Array, list[int], float]] = []

    def add_events(self, modes: list[int], t: float) -> None:
        """Count the events among modes that are those of axes of the connector.

        Args:
            modes: The modes whose event functions have reached zero.
            t: The time, s.
        """
        places = range(self._first, self._first + self._count)
        for axis in sorted({(mode - self._first) % 3 for mode in modes if mode in places}):
            self._log.add_switch(t, axis)

    def add_transitions(self, before: System, after: System, t: float) -> None:
        """Store the axes that stick or are released between two systems at one time."""
        if before is after:
            return
        held = zip(_held(before), _held(after), strict=True)
        for axis, (was, now) in enumerate(held):
            if was != now:
                kind = Transition.STICK if now else Transition.RELEASE
                self._log.add_transition(t, axis, kind)

    def add_sample(self, system: System, y: Array) -> None:
        """Store the modes and the switches so far as those of a sample.

        Args:
            system: The system in the modes of the sample.
            y: The state.
        """
        side, _ = _connector(system).side_and_layer()
        energy = chatter_energy(system, y[BODY]) if self._diagnosed else np.nan
        self._samples.append((side, self._log.counts.copy(), energy))

    def repeat_sample(self, system: System, y: Array) -> None:
        """Store the last sample again, after a breakpoint at its time."""
        self._samples.pop()
        self.add_sample(system, y)

    def trace(self) -> SwitchTrace:
        """Return the switches of the samples so far, without `trusted_until`."""
        modes, counts, energies = zip(*self._samples, strict=True)
        return SwitchTrace(
            modes=np.array(modes),
            counts=np.array(counts),
            chatter_energy=np.array(energies),
            discarded_energy=np.zeros(len(energies)),
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
