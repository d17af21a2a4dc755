"""An element of a user as the formulas that its code states, for any kind of number.

Exact motions are enclosed with these formulas, not with the code. So what is proved of a motion is
proved of the formulas of which the rest states are.
"""

import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from itertools import product
from typing import Any

import numpy as np

from rbstab.analysis.configuration import Configurations, configurations
from rbstab.analysis.proof.formulas.program import (
    Operation,
    indices_of,
    needed_by,
    operations_of,
    variables_of,
)
from rbstab.analysis.proof.formulas.terms import meant
from rbstab.analysis.proof.traced.passive import TIMED
from rbstab.analysis.proof.traced.separate import in_proofs
from rbstab.analysis.proof.traced.tracing import (
    ENTRY,
    TIME,
    NotRecordedError,
    entries_of,
    free_motion,
    index_in,
    traced_motion,
    with_recorded_parameters,
)
from rbstab.elements.element import Element
from rbstab.integrate.straight_line.number import (
    ADD,
    CONSTANT,
    DIVIDE,
    MULTIPLY,
    NEGATE,
    POWER,
    SUBTRACT,
    Trace,
)
from rbstab.mechanics.motion import Motion, Wrench
from rbstab.mechanics.numbers import FUNCTIONS, Array, Number, power
from rbstab.systems.system import System

Numbers = Callable[[Array], Array]
"""Converts doubles to a kind of number: those of a config to the decimals that they mean."""


GUARDS_SWITCH = "its event functions depend on its modes"


@dataclass(frozen=True, eq=False)
class RecordedElement(Element):
    """The statements of an element of a user, from its recorded operations.

    Args:
        name: Its name.
        by_mode: The statements in each tuple of its modes.
        mode: Its modes, shape (mode_count,), each 0 or 1.
    """

    name: str
    by_mode: "Mapping[tuple[float, ...], Formulas]"
    mode: Array = field(default_factory=lambda: np.zeros(0))

    @property
    def formulas(self) -> "Formulas":
        """The statements in its modes."""
        return self.by_mode[tuple(map(float, self.mode))]

    def guards(self, motion: Motion, own: Array) -> Array:
        """Return the event functions."""
        return self.formulas("guards", motion, own)

    def wrench(self, motion: Motion, own: Array) -> Wrench:
        """Return the force, couple and contact force on the body."""
        force, couple, at_contact = np.split(self.formulas("wrench", motion, own), 3)
        return Wrench(force, couple, at_contact)

    def stored(self, motion: Motion, own: Array) -> Number:
        """Return the stored energy, J."""
        return self.formulas("stored", motion, own)[0]

    def dissipated(self, motion: Motion, own: Array) -> Number:
        """Return the dissipated power, W."""
        return self.formulas("dissipated", motion, own)[0]

    def rates(self, motion: Motion, own: Array) -> Array:
        """Return the derivatives of the own states."""
        return self.formulas("rates", motion, own)


class Formulas:
    """Formulas of the entries of a motion and of own states.

    Args:
        operations: The operations.
        results: The indices of the results of each statement.
        numbers: Converts the constants.
    """

    def __init__(
        self,
        operations: Sequence[Operation],
        results: Mapping[str, Sequence[int]],
        numbers: Numbers,
    ) -> None:
        self._operations, self._results = operations, results
        self._needed = {name: needed_by(operations, some) for name, some in results.items()}
        self._constants = {
            index: _converted(operand, numbers)
            for index, (kind, operand, *_) in enumerate(operations)
            if kind == CONSTANT
        }

    def recorded(self, name: str) -> tuple[Any, ...]:
        """Return the operations and the places of the results of the first statement."""
        results = tuple(self._results[name])
        return tuple(self._operations[: 1 + max(results, default=-1)]), results

    def __call__(self, name: str, motion: Motion, own: Array) -> Array:
        """Return the results of a statement."""
        entries, found = entries_of(motion, own), dict[int, Number]()
        for index in self._needed[name]:
            kind, *operands = operation = self._operations[index]
            indices = indices_of(operation)
            if indices:
                numbers = [found[one] for one in indices]
                found[index] = _combined(kind, *numbers, *operands[len(indices) :])
            elif kind == CONSTANT:
                found[index] = self._constants[index]
            else:
                assert kind == ENTRY  # `recorded_element` refuses the time
                found[index] = entries[operands[0]]
        results = self._results[name]
        values = np.empty(len(results), dtype=object)
        for place, index in enumerate(results):
            values[place] = found[index]
        return values


def recorded_element(at_rest: Configurations, element: Element, numbers: Numbers) -> Element:
    """Return an element of a user as its recorded formulas.

    Args:
        at_rest: The configurations of its system, in doubles.
        element: The element.
        numbers: The kind of number of its parameters, and of the constants of its code.

    Raises:
        NotRecordedError: Its code cannot be recorded, or it depends on the time.
    """
    by_mode = {}
    for modes in product((0.0, 1.0), repeat=element.mode_count):
        try:
            operations, results = _statements(at_rest, element, modes)
        except Exception as error:
            # An element of a user may raise anything.
            raise NotRecordedError(str(error) or type(error).__name__) from error
        if TIME in variables_of(operations, {one for some in results.values() for one in some}):
            raise NotRecordedError(TIMED)
        by_mode[modes] = Formulas(operations, results, numbers)
    if len({one.recorded("guards") for one in by_mode.values()}) > 1:
        raise NotRecordedError(GUARDS_SWITCH)
    stated = {"states": element.states, "mode_count": element.mode_count}
    kind = type(type(element).__name__, (RecordedElement,), stated)
    found: Element = kind(element.name, by_mode, np.zeros(element.mode_count))
    return found


def why_not_recorded(system: System) -> str | None:
    """Return why an element of a user has no formulas at all states; None if all have."""
    at_rest = configurations(system)
    for element in system.elements:
        if not element.from_user:
            continue
        if not in_proofs(element):
            return f"{element.name} is code of a user that switches by its loads, or has many modes"
        try:
            recorded_element(at_rest, element, lambda values: values)
        except NotRecordedError as error:
            return f"{element.name} is code of a user that cannot be recorded: {error}"
    return None


def _statements(
    at_rest: Configurations, element: Element, modes: tuple[float, ...]
) -> tuple[Sequence[Operation], Mapping[str, Sequence[int]]]:
    """Return the operations of all statements in some modes, and the indices of their results."""
    _, any_motion, any_own = traced_motion(at_rest, element, (Trace(), {}))
    trace, inputs = recorded = Trace(), dict[int, Operation]()
    motion, own = free_motion(recorded, any_motion, any_own)
    mine: Any = with_recorded_parameters(at_rest.system, element, recorded)
    if modes:
        mine = replace(mine, mode=np.array(modes))
    stated: dict[str, Any] = {
        "guards": mine.guards(motion, own) if modes else (),
        "wrench": np.concatenate(mine.wrench(motion, own)),
        "stored": [mine.stored(motion, own)],
        "dissipated": [mine.dissipated(motion, own)],
        "rates": mine.rates(motion, own),
    }
    results = {name: [index_in(trace, one) for one in some] for name, some in stated.items()}
    return operations_of(trace, inputs), results


def _converted(constant: float, numbers: Numbers) -> Number:
    """Return the number that a constant means."""
    exact = meant(constant)
    if exact == Fraction(repr(constant)):
        return numbers(np.array(constant))[()]
    dividend, divisor = numbers(np.array([exact.numerator, exact.denominator], dtype=float))
    return dividend / divisor


def _combined(kind: str, *operands: Any) -> Number:
    if kind == POWER:
        base, exponent = operands
        if exponent == 0:
            return 1.0
        found = power(base, abs(exponent))
        return found if exponent > 0 else 1.0 / found
    return _OPERATIONS[kind](*operands) if kind in _OPERATIONS else FUNCTIONS[kind](*operands)


_OPERATIONS: Mapping[str, Callable[..., Number]] = {
    ADD: operator.add,
    SUBTRACT: operator.sub,
    MULTIPLY: operator.mul,
    DIVIDE: operator.truediv,
    NEGATE: operator.neg,
}
