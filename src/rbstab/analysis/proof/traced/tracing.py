"""The statements of an element of a user, recorded: as operations on a motion and its parameters.

The code is called once, with numbers that record what it does with them. So what is proved holds
for the formulas that it states then. The compiled equations of runs are recorded in the same way.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np

from rbstab.analysis.configuration import Configurations
from rbstab.analysis.proof.formulas.program import (
    LENGTH,
    THETA,
    Operation,
    Program,
    program_of,
)
from rbstab.elements.element import Element
from rbstab.integrate.straight_line.number import CONSTANT, Trace
from rbstab.mechanics.motion import Motion
from rbstab.mechanics.numbers import Array
from rbstab.systems.parameters import map_parameters
from rbstab.systems.system import System

VELOCITY = "velocity"
"""The kind of an entry of Ω, or of V as the entries 3 to 5."""

TIME = "time"

Recorded = tuple[Trace, dict[int, Operation]]
"""The operations, and what stands for each input of them."""


class NotRecordedError(Exception):
    """The code of an element did not run with recorded numbers."""


@dataclass(frozen=True, eq=False)
class TracedStatements:
    """The stored energy of an element, at any state of the body and of the element.

    Args:
        trace: The operations.
        inputs: What stands for each input of the trace.
        stored: The index of the stored energy.
    """

    trace: Trace
    inputs: dict[int, Operation]
    stored: int

    @property
    def energy(self) -> Program:
        """The stored energy as a formula of Θ and x."""
        return program_of(self.trace, self.stored, self.inputs)


def traced_statements(at_rest: Configurations, element: Element) -> TracedStatements:
    """Record the statements of an element.

    Args:
        at_rest: The configurations of its system, in doubles.
        element: One of the elements of this system.

    Raises:
        NotRecordedError: Its code cannot be recorded.
    """
    try:
        return _statements(at_rest, element)
    except Exception as error:
        # An element of a user may raise anything.
        raise NotRecordedError(str(error) or type(error).__name__) from error


def own_entries(at_rest: Configurations, element: Element) -> range:
    """Return the entries of x = [X, D], or of x = D, that are the own states of an element."""
    begin = at_rest.pose_size - 3
    for other in at_rest.system.elements:
        if other is element:
            break
        begin += other.state_size
    return range(begin, begin + element.state_size)


def traced_motion(
    at_rest: Configurations, element: Element, recorded: Recorded
) -> tuple[System, Motion, Array]:
    """Return a system with recorded parameters, any motion of it, and the own states of an element.

    Args:
        at_rest: The configurations of the system, in doubles.
        element: The element.
        recorded: The trace, to which they are added.
    """
    system = map_parameters(at_rest.system, partial(_parameters, recorded))
    Theta, x = variables(recorded, THETA, 3), variables(recorded, LENGTH, at_rest.size - 3)
    Omega, V = np.split(variables(recorded, VELOCITY, at_rest.pose_size), [3])
    (time,) = variables(recorded, TIME, 1)
    motion = system.motion(np.concatenate([Theta, Omega, x[: len(V)], V]), time)
    entries = own_entries(at_rest, element)
    return system, motion, x[entries.start : entries.stop]


def _statements(at_rest: Configurations, element: Element) -> TracedStatements:
    trace, inputs = recorded = Trace(), dict[int, Operation]()
    system, motion, own = traced_motion(at_rest, element, recorded)
    mine = system.elements[at_rest.system.elements.index(element)]
    return TracedStatements(trace, inputs, index_in(trace, mine.stored(motion, own)))


def _parameters(recorded: Recorded, _: str, values: Array) -> Array:
    """Return parameters as inputs of a trace; zeros stay numbers."""
    trace, inputs = recorded
    entries = np.empty(values.size, dtype=object)
    for place, value in enumerate(values.ravel().tolist()):
        entries[place] = 0.0
        if value != 0.0:
            entries[place] = number = trace.input(varies=False)
            inputs[number.index] = (CONSTANT, float(value))
    return entries.reshape(values.shape)


def variables(recorded: Recorded, kind: str, size: int, first: int = 0) -> Array:
    """Return variables as inputs of a trace, numbered from `first` on."""
    trace, inputs = recorded
    numbers = np.empty(size, dtype=object)
    for place in range(size):
        numbers[place] = number = trace.input(varies=True)
        inputs[number.index] = (kind, first + place)
    return numbers


def index_in(trace: Trace, number: object) -> int:
    """Return the index of a number, which may be the entry of an array of shape ()."""
    return trace.index_of(number.item() if isinstance(number, np.ndarray) else number)
