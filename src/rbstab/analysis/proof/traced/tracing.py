"""The statements of an element of a user, recorded: as operations on Θ, Ω and its parameters.

The code is called once, with numbers that record what it does with them. So what is proved holds
for the formulas that it states then. The compiled equations of runs are recorded in the same way.
"""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from rbstab.analysis.configuration import Configurations
from rbstab.analysis.proof.traced.program import THETA, Operation, Program, program_of
from rbstab.elements.element import NO_STATE, Element
from rbstab.integrate.straight_line.number import CONSTANT, Trace, TracedNumber
from rbstab.mechanics.motion import Motion
from rbstab.mechanics.numbers import Array
from rbstab.systems.parameters import map_parameters
from rbstab.systems.system import System

OMEGA = "omega"

TIME = "time"

ENTRY = "entry"
"""The kind of an entry of a motion that is taken as a variable of its own."""

Recorded = tuple[Trace, dict[int, Operation]]
"""The operations, and what stands for each input of them."""


class NotRecordedError(Exception):
    """The code of an element did not run with recorded numbers."""


@dataclass(frozen=True, eq=False)
class TracedStatements:
    """The statements of an element about a body that is held, at any Θ and Ω.

    Args:
        trace: The operations.
        inputs: What stands for each input of the trace.
        stored: The index of the stored energy.
        rates: The indices of the three entries of dΘ/dt.
        power: The index of the power of the wrench on the body, W.
        dissipated: The index of the dissipated power, W.
        loss: The dissipated power as a formula of the entries of the motion: of Ω, V, A and so on.
    """

    trace: Trace
    inputs: dict[int, Operation]
    stored: int
    rates: tuple[int, int, int]
    power: int
    dissipated: int
    loss: Program

    @property
    def energy(self) -> Program:
        """The stored energy as a formula of Θ."""
        return program_of(self.trace, self.stored, self.inputs)


def traced_statements(at_rest: Configurations, element: Element) -> TracedStatements:
    """Record the statements of an element.

    Args:
        at_rest: The configurations of its system, in doubles; the body is held.
        element: One of the elements of this system.

    Raises:
        NotRecordedError: Its code cannot be recorded.
    """
    trace, inputs = Trace(), dict[int, Operation]()
    place = at_rest.system.elements.index(element)
    try:
        system = map_parameters(at_rest.system, partial(_parameters, (trace, inputs)))
        own = system.elements[place]
        Theta, Omega = (_variables((trace, inputs), kind, 3) for kind in (THETA, OMEGA))
        (time,) = _variables((trace, inputs), TIME, 1)
        motion = system.motion(np.concatenate([Theta, Omega]), time)
        wrench = own.wrench(motion, NO_STATE)
        # The contact point is held, so a force there has no power.
        power = wrench.force @ motion.V + wrench.couple @ motion.Omega
        stored, dissipated = own.stored(motion, NO_STATE), own.dissipated(motion, NO_STATE)
        first, second, third = (trace.index_of(entry) for entry in motion.B @ motion.Omega)
        found = (_index(trace, number) for number in (stored, power, dissipated))
        at_stored, at_power, at_dissipated = found
        loss = _loss(at_rest.system, element, motion)
    except Exception as error:
        # An element of a user may raise anything.
        raise NotRecordedError(str(error) or type(error).__name__) from error
    rates = (first, second, third)
    return TracedStatements(trace, inputs, at_stored, rates, at_power, at_dissipated, loss)


def _loss(system: System, element: Element, motion: Motion) -> Program:
    """Return the dissipated power as a formula of the entries of a motion."""
    trace, inputs = recorded = Trace(), dict[int, Operation]()

    def opaque(part: Array) -> Array:
        part = np.asarray(part, dtype=object)
        # A number that is known, such as that of E = 0, stays what it is.
        known = [not isinstance(entry, TracedNumber) for entry in part.ravel()]
        variables = _variables(recorded, ENTRY, part.size)
        return np.where(known, part.ravel(), variables).reshape(part.shape)

    parts = motion._asdict()
    del parts["time"]
    (time,) = _variables(recorded, TIME, 1)
    free = Motion(**{name: opaque(part) for name, part in parts.items()}, time=time)
    alone = replace(system, elements=(element,))
    (own,) = map_parameters(alone, partial(_parameters, recorded)).elements
    return program_of(trace, _index(trace, own.dissipated(free, NO_STATE)), inputs)


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


def _variables(recorded: Recorded, kind: str, count: int) -> Array:
    """Return variables as inputs of a trace."""
    trace, inputs = recorded
    numbers = np.empty(count, dtype=object)
    for place in range(count):
        numbers[place] = number = trace.input(varies=True)
        inputs[number.index] = (kind, place)
    return numbers


def _index(trace: Trace, number: object) -> int:
    """Return the index of a number, which may be the entry of an array of shape ()."""
    return trace.index_of(number.item() if isinstance(number, np.ndarray) else number)
