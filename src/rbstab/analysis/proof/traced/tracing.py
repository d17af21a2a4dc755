"""The statements of an element of a user, recorded: as operations on a motion and its parameters.

The code is called once, with numbers that record what it does with them. So what is proved holds
for the formulas that it states then. The compiled equations of runs are recorded in the same way.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import count
from typing import NamedTuple

import numpy as np

from rbstab.analysis.configuration import Configurations
from rbstab.analysis.proof.formulas.program import (
    LENGTH,
    THETA,
    Operation,
    Program,
    operations_of,
    program_of,
)
from rbstab.elements.element import Element
from rbstab.integrate.straight_line.number import CONSTANT, Trace, TracedNumber
from rbstab.mechanics.algebra import ZERO
from rbstab.mechanics.motion import Motion
from rbstab.mechanics.numbers import Array
from rbstab.systems.parameters import map_parameters
from rbstab.systems.system import System

VELOCITY = "velocity"
"""The kind of an entry of Ω, or of V as the entries 3 to 5."""

TIME = "time"

ENTRY = "entry"
"""The kind of an entry of a motion that is taken as a variable of its own."""

Recorded = tuple[Trace, dict[int, Operation]]
"""The operations, and what stands for each input of them."""

Triple = tuple[int, int, int]


class NotRecordedError(Exception):
    """The code of an element did not run with recorded numbers."""


class Loss(NamedTuple):
    """The dissipated power as a formula.

    Attributes:
        operations: All operations.
        result: The index of the dissipated power.
        velocities: The indices of the entries of a velocity, in each frame in which it is computed.
    """

    operations: Sequence[Operation]
    result: int
    velocities: tuple[Triple, ...]


@dataclass(frozen=True, eq=False)
class TracedStatements:
    """The statements of an element, at any state of the body and of the element.

    Args:
        trace: The operations.
        inputs: What stands for each input of the trace.
        stored: The index of the stored energy.
        rates: The index of the rate of each variable on which it may depend: of Θ and x.
        power: The index of the power of the wrench on the body, W.
        dissipated: The index of the dissipated power, W.
        loss: The dissipated power as a formula of the entries of the motion and of the own states,
            each a variable of its own: of Ω, V, A and so on. Its velocity is Ω.
        loss_without_turning: The same for Ω = 0; its velocity is V. None if the body is held.
        own: The entries of x that are the own states of the element.
        own_rates: Their rates while the body is at rest, as formulas of Θ and x.
    """

    trace: Trace
    inputs: dict[int, Operation]
    stored: int
    rates: Mapping[Operation, int]
    power: int
    dissipated: int
    loss: Loss
    loss_without_turning: Loss | None
    own: range
    own_rates: tuple[Program, ...]

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
    wrench = mine.wrench(motion, own)
    power = wrench.force @ motion.V + wrench.couple @ motion.Omega
    rates = {(THETA, i): rate for i, rate in enumerate(motion.B @ motion.Omega)}
    still = [motion.Theta, ZERO]
    if not at_rest.held:  # else a force at the contact point has no power
        power = power + wrench.contact_force @ motion.F
        rates |= {(LENGTH, i): rate for i, rate in enumerate(motion.V)}
        still += [motion.X, ZERO]
    entries, own_rates = own_entries(at_rest, element), []
    if entries:
        rates |= {(LENGTH, i): r for i, r in zip(entries, mine.rates(motion, own), strict=True)}
        own_rates = list(mine.rates(system.motion(np.concatenate(still), motion.time), own))
    return TracedStatements(
        trace,
        inputs,
        index_in(trace, mine.stored(motion, own)),
        {variable: index_in(trace, rate) for variable, rate in rates.items()},
        index_in(trace, power),
        index_in(trace, mine.dissipated(motion, own)),
        _loss(at_rest.system, element, motion, own),
        None if at_rest.held else _loss_without_turning(at_rest.system, element),
        entries,
        tuple(program_of(trace, index_in(trace, rate), inputs) for rate in own_rates),
    )


def _loss(system: System, element: Element, motion: Motion, own: Array) -> Loss:
    """Return the dissipated power as a formula of the entries of a motion and of own states."""
    recorded = Trace(), dict[int, Operation]()
    free, states = free_motion(recorded, motion, own)
    dissipated = with_recorded_parameters(system, element, recorded).dissipated(free, states)
    return _formula(recorded, dissipated, [free.Omega, free.A @ free.Omega])


def free_motion(recorded: Recorded, motion: Motion, own: Array) -> tuple[Motion, Array]:
    """Return a motion and own states whose entries are variables: see `entries_of`.

    A number that is known, such as that of E = 0, stays what it is.
    """
    places = count()

    def opaque(part: Array) -> Array:
        found = np.array(part, dtype=object)
        for index, place in zip(np.ndindex(found.shape), places, strict=False):
            if isinstance(found[index], TracedNumber):
                (found[index],) = variables(recorded, ENTRY, 1, place)
        return found

    (time,) = variables(recorded, TIME, 1)
    names = [name for name in Motion._fields if name != "time"]
    parts = {name: opaque(getattr(motion, name)) for name in names}
    return Motion(**parts, time=time), opaque(own)


def entries_of(motion: Motion, own: Array) -> Array:
    """Return the entries of a motion, without its time, and of own states, one after the other."""
    *parts, _ = motion
    return np.concatenate([np.asarray(part).ravel() for part in (*parts, own)])


def _loss_without_turning(system: System, element: Element) -> Loss:
    """Return the dissipated power of a body that moves but does not turn."""
    recorded = Trace(), dict[int, Operation]()
    Theta, V = variables(recorded, THETA, 3), variables(recorded, VELOCITY, 3)
    X, own = variables(recorded, LENGTH, 3), variables(recorded, ENTRY, element.state_size)
    (time,) = variables(recorded, TIME, 1)
    single = map_parameters(replace(system, elements=(element,)), partial(_parameters, recorded))
    motion = single.motion(np.concatenate([Theta, ZERO, X, V]), time)
    (mine,) = single.elements
    return _formula(recorded, mine.dissipated(motion, own), [V, motion.A.T @ V])


def with_recorded_parameters(system: System, element: Element, recorded: Recorded) -> Element:
    """Return an element with recorded parameters."""
    single = replace(system, elements=(element,))
    (found,) = map_parameters(single, partial(_parameters, recorded)).elements
    return found


def _formula(recorded: Recorded, dissipated: object, velocities: Sequence[Array]) -> Loss:
    trace, inputs = recorded
    result = index_in(trace, dissipated)
    places = []
    for velocity in velocities:
        first, second, third = (index_in(trace, entry) for entry in velocity)
        places.append((first, second, third))
    return Loss(operations_of(trace, inputs), result, tuple(places))


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
