"""What an engine is given, and what it returns."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from rbstab.integrate.status import RunStatus
from rbstab.integrate.switch_trace import SwitchTrace
from rbstab.mechanics.numbers import Array
from rbstab.systems.system import AUDIT_SIZE, System

Progress = Callable[[float], None]
"""Called with the time reached, s, after every step."""


@dataclass(frozen=True)
class Switching:
    """How the modes of a sliding connector change, besides what the connector itself says.

    Args:
        layered: Whether a boundary layer replaces the sign.
        step: The step of the implicit law, s; 0: the law is followed exactly.
        stick_energy: On s = E an axis sticks when its chatter energy is below this, J; 0: never.
        switch_limit: The run stops after so many switches.
        stored_switches: Switches whose time and axis are kept; later ones are only counted.
    """

    layered: bool = False
    step: float = 0.0
    stick_energy: float = 0.0
    switch_limit: int = 10_000_000
    stored_switches: int = 100_000

    @property
    def sticks(self) -> bool:
        """Whether axes that chatter may be taken to stick."""
        return self.stick_energy > 0 and not self.layered and self.step == 0


@dataclass(frozen=True, eq=False)
class Problem:
    """An initial value problem with its samples, tolerances and limits.

    Args:
        system: The equations.
        start: The state vector at the first sample, shape (system.size,).
        times: The samples, shape (samples,), s, ascending.
        rtol: Relative tolerance of a step.
        atol: Absolute tolerance of a step, in the states' units (scipy only).
        method: The name of SciPy's integrator (scipy only).
        range_bound: The run stops where cos θ2 falls to this (eq. 5).
        project: Whether every step is returned to the sub manifold E = F = 0 (eq. 16).
        step_limit: The largest number of steps.
        time_limit: The longest wall time, s.
        switching: How the modes of a sliding connector change, where the system has one.
        diagnosed: Whether a run that slides tells its chatter energy, and how far it can be
            trusted, which takes a second run.
    """

    system: System
    start: Array
    times: Array
    rtol: float
    atol: float
    method: str
    range_bound: float
    project: bool
    step_limit: int
    time_limit: float
    switching: Switching | None = None
    diagnosed: bool = True

    def audited_start(self) -> Array:
        """The state vector at the first sample with the audit states, which start at zero."""
        return np.concatenate([self.start, np.zeros(AUDIT_SIZE)])


@dataclass(frozen=True, eq=False)
class Trajectory:
    """The samples that were reached, then, where the run stopped early, the state of the stop.

    Args:
        times: Shape (n,), s.
        states: Shape (n, system.size).
        lyapunov_change: ∫v' dt, shape (n,), J.
        contact_work: ε of eq. 26, shape (n,), J.
        status: How the run ended.
        detail: The same in words, with the time.
        steps: Accepted steps.
        evaluations: Evaluations of the rates; for a Taylor engine, of its expansion.
        switches: The switching of a sliding connector, where there is one.
        systems: The smooth system that holds at each sample; empty where it is always the same.
    """

    times: Array
    states: Array
    lyapunov_change: Array
    contact_work: Array
    status: RunStatus
    detail: str
    steps: int
    evaluations: int
    switches: SwitchTrace | None = None
    systems: tuple[System, ...] = ()


class Engine(Protocol):
    """An integrator behind the common interface."""

    def __call__(self, problem: Problem, progress: Progress | None = None) -> Trajectory:
        """Integrates a problem. Never raises for what a motion does: that is a status."""
        ...


def trajectory(
    samples: list[tuple[float, Array]],
    status: RunStatus,
    detail: str,
    steps: int,
    evaluations: int,
) -> Trajectory:
    """Splits audited state vectors into a trajectory."""
    table = np.array([state for _, state in samples])
    return Trajectory(
        np.array([time for time, _ in samples]),
        table[:, :-AUDIT_SIZE],
        table[:, -2],
        table[:, -1],
        status,
        detail,
        steps,
        evaluations,
    )
