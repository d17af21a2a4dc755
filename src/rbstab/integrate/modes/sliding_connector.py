"""A sliding controller beside elements that switch, supply power or have states of their own.

The drivers in `integrate.switching` follow a sliding connector alone. Beside such elements its axes
are modes like theirs, and the driver of modes follows all of them.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from rbstab.elements.sliding import SlidingConnector
from rbstab.elements.sliding_ties import (
    AtContact,
    CrossingConnector,
    FilippovConnector,
    LayeredConnector,
    StickingConnector,
)
from rbstab.integrate.deadline import Deadline
from rbstab.integrate.problem import Problem, Trajectory
from rbstab.integrate.switching.modes import connector_of
from rbstab.integrate.switching.trust import perturbed_start, trusted_until
from rbstab.systems.filippov import START_TOLERANCE
from rbstab.systems.impact import stop_of
from rbstab.systems.modes import has_modes
from rbstab.systems.system import System

LEAST_CHANGE = 1e-20
"""The least change of a state at the start of the second run: the engine heyoka diverges from
states of rest that differ from zero by the smallest number of a computer."""


def follows_modes(problem: Problem) -> bool:
    """Return whether the driver of modes follows the sliding connector of a problem."""
    system = problem.system
    others = has_modes(system) or system.supplies or system.size > system.coordinates.size
    return problem.switching is not None and others


def drive_by_modes(
    problem: Problem, integrate: Callable[[Problem], Trajectory], deadline: Deadline
) -> Trajectory:
    """Integrate a problem whose sliding connector `follows_modes`, and find how far it is trusted.

    Args:
        problem: The problem.
        integrate: Integrates a problem whose elements switch, with the switches of its connector.
        deadline: The deadline of both runs.
    """
    assert problem.switching is not None
    by_modes = replace(problem, system=with_connector_by_modes(problem))
    run = integrate(by_modes)
    if run.switches is None or not problem.diagnosed:
        return run
    samples = deadline.samples
    second = integrate(
        replace(by_modes, start=perturbed_start(problem, LEAST_CHANGE), diagnosed=False)
    )
    deadline.samples = samples
    ends = [None] * (len(second.times) - 1) + [second.status]
    rows = zip(second.times.tolist(), second.states, ends, strict=True)
    return replace(run, switches=run.switches._replace(trusted_until=trusted_until(run, rows)))


def with_connector_by_modes(problem: Problem) -> System:
    """Return the system of a problem with a sliding connector that has modes 0 and 1."""
    system, switching = problem.system, problem.switching
    assert switching is not None
    if switching.step:
        raise ValueError("implicit steps are those of a sliding connector alone")
    connector = connector_of(system)
    kind: type[AtContact] = CrossingConnector
    if switching.layered:
        kind = LayeredConnector
    elif connector.rate_weight:
        kind = FilippovConnector
    elif switching.sticks or _begins_at_rest(problem):
        kind = StickingConnector
    changed = kind(
        K_s=connector.K_s,
        rate_weight=connector.rate_weight,
        slope=connector.slope,
        layer_width=connector.layer_width,
    )
    elements = (changed if isinstance(e, SlidingConnector) else e for e in system.elements)
    return replace(system, elements=tuple(elements))


def _begins_at_rest(problem: Problem) -> bool:
    """Return whether an axis of the contact point begins at E = F = 0, and so may be held.

    No axis is held beside a stop: the forces of both would have to be solved together.
    """
    if stop_of(problem.system) is not None:
        return False
    motion = problem.system.motion(problem.start)
    at_rest = np.maximum(np.abs(motion.E), np.abs(motion.F)) <= START_TOLERANCE
    return bool(at_rest.any())
