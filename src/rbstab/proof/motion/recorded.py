"""An element of a user as the formulas that its code states, for any kind of number.

Exact motions are enclosed with these formulas, not with the code: the same ones of which the rest
states are. The operations are those of the compiled equations of runs (`straight_line`), so a sum
stays the product or the power of sums that the code states.
"""

import operator
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from itertools import count, product
from typing import Any

import numpy as np

from rbstab.analysis.configuration import Configurations, configurations
from rbstab.elements.element import Element
from rbstab.integrate.straight_line.number import (
    ADD,
    CONSTANT,
    DIVIDE,
    INPUT,
    MULTIPLY,
    NEGATE,
    POWER,
    SUBTRACT,
    Trace,
    TracedNumber,
)
from rbstab.mechanics.motion import Motion, Wrench
from rbstab.mechanics.numbers import FUNCTIONS, Array, Number, power
from rbstab.proof.exact.expr import as_decimal, meant
from rbstab.proof.passive.passive import TIMED, in_proofs
from rbstab.proof.passive.statements import PARTS, NotRecordedError
from rbstab.systems.parameters import map_parameters
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
        alone: A system with the element alone.
        modes: Its modes.
        motion: A motion of traced numbers.
        own: Own states of traced numbers.
        numbers: Converts the constants.

    Raises:
        NotRecordedError: A statement depends on the time.
    """

    def __init__(
        self,
        alone: System,
        modes: tuple[float, ...],
        motion: Motion,
        own: Array,
        numbers: Numbers,
    ) -> None:
        self._trace = Trace()
        self._parameters, self._entries = dict[int, float](), dict[int, int]()
        places = count()
        time = self._trace.input(varies=True)
        parts = {name: self._opaque(getattr(motion, name), places) for name in PARTS}
        free, states = Motion(**parts, time=time), self._opaque(own, places)
        mine: Any = self._with_inputs(alone)
        if modes:
            mine = replace(mine, mode=np.array(modes))
        stated: dict[str, Any] = {
            "guards": mine.guards(free, states) if modes else (),
            "wrench": np.concatenate(mine.wrench(free, states)),
            "stored": [mine.stored(free, states)],
            "dissipated": [mine.dissipated(free, states)],
            "rates": mine.rates(free, states),
        }
        self._results = {
            name: [self._trace.index_of(np.asarray(one, dtype=object).item()) for one in some]
            for name, some in stated.items()
        }
        self._needed = {name: self._needed_by(some) for name, some in self._results.items()}
        if any(time.index in needed for needed in self._needed.values()):
            raise NotRecordedError(TIMED)
        self._constants = {
            k: _converted(one.operands[0], numbers)
            for k, one in enumerate(self._trace.operations)
            if one.kind == CONSTANT
        }
        self._constants |= {k: numbers(np.array(x))[()] for k, x in self._parameters.items()}

    def _opaque(self, part: Array, places: "count[int]") -> Array:
        """Return inputs in place of the traced entries; a known number stays what it is."""
        found = np.array(part, dtype=object)
        for index, place in zip(np.ndindex(found.shape), places, strict=False):
            if isinstance(found[index], TracedNumber):
                found[index] = number = self._trace.input(varies=True)
                self._entries[number.index] = place
        return found

    def _with_inputs(self, alone: System) -> Element:
        """Return the element of a system with inputs as its parameters; zeros stay numbers."""

        def parameters(_: str, values: Array) -> Array:
            found = _inputs(self._trace, values)
            for index in np.ndindex(values.shape):
                number = found[index]
                if isinstance(number, TracedNumber):
                    self._parameters[number.index] = float(values[index])
            return found

        (found,) = map_parameters(alone, parameters).elements
        return found

    def _needed_by(self, results: list[int]) -> list[int]:
        needed = set(results)
        for index in range(max(results, default=-1), -1, -1):
            if index in needed:
                needed.update(self._operands(index))
        return sorted(needed)

    def _operands(self, index: int) -> tuple[Any, ...]:
        kind, operands, _ = self._trace.operations[index]
        if kind in {INPUT, CONSTANT}:
            return ()
        return operands[:1] if kind == POWER else operands

    def recorded(self, name: str) -> tuple[Any, ...]:
        """Return the operations and the places of the results of one statement."""
        operations = [(k, self._trace.operations[k]) for k in self._needed[name]]
        return tuple(operations), tuple(self._results[name])

    def __call__(self, name: str, motion: Motion, own: Array) -> Array:
        """Return the results of a statement."""
        entries = np.concatenate([np.asarray(part).ravel() for part in (*motion[:-1], own)])
        found = dict[int, Number]()
        for index in self._needed[name]:
            kind, operands, _ = self._trace.operations[index]
            if index in self._constants:
                found[index] = self._constants[index]
            elif kind == INPUT:
                found[index] = entries[self._entries[index]]
            elif kind == POWER:
                exponent = int(self._trace.operations[operands[1]].operands[0])
                found[index] = _raised(found[operands[0]], exponent)
            else:
                found[index] = _OPERATIONS[kind](*(found[one] for one in operands))
        values = np.empty(len(self._results[name]), dtype=object)
        for place, index in enumerate(self._results[name]):
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
    trace = Trace()
    system = map_parameters(at_rest.system, lambda _, values: _inputs(trace, values))
    y = _inputs(trace, np.ones(system.coordinates.size))
    motion = system.motion(y, trace.input(varies=True))
    own = _inputs(trace, np.ones(element.state_size))
    alone, by_mode = replace(at_rest.system, elements=(element,)), {}
    for modes in product((0.0, 1.0), repeat=element.mode_count):
        try:
            by_mode[modes] = Formulas(alone, modes, motion, own, numbers)
        except NotRecordedError:
            raise
        except Exception as error:
            # An element of a user may raise anything.
            raise NotRecordedError(str(error) or type(error).__name__) from error
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
        except (NotRecordedError, TypeError, ValueError) as error:
            return f"{element.name} is code of a user that cannot be recorded: {error}"
    return None


def _inputs(trace: Trace, values: Array) -> Array:
    """Return inputs of a trace in place of numbers other than zero."""
    entries = [trace.input(varies=True) if x != 0 else 0.0 for x in values.ravel().tolist()]
    found = np.empty(values.size, dtype=object)
    found[:] = entries
    return found.reshape(values.shape)


def _converted(constant: float, numbers: Numbers) -> Number:
    """Return the number that a constant of the code means."""
    exact = meant(constant)
    if exact == as_decimal(constant):
        return numbers(np.array(constant))[()]
    dividend, divisor = numbers(np.array([exact.numerator, exact.denominator], dtype=float))
    return dividend / divisor


def _raised(base: Number, exponent: int) -> Number:
    if exponent == 0:
        return 1.0
    found = power(base, abs(exponent))
    return found if exponent > 0 else 1.0 / found


_OPERATIONS: Mapping[str, Callable[..., Number]] = {
    ADD: operator.add,
    SUBTRACT: operator.sub,
    MULTIPLY: operator.mul,
    DIVIDE: operator.truediv,
    NEGATE: operator.neg,
    **FUNCTIONS,
}
