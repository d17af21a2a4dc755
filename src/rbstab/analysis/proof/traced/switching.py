"""The energy of an element of a user that switches.

With σ_i = 1 where the event function g_i is positive, and else 0, it is shown that

    E = E₀ + Σ σ_i (h_i g_i² + k_i g_i),    so E = E₀ + Σ h_i p(g_i) + Σ max(k_i g_i, 0),

with p(g) = max(g, 0)², and with E₀, h_i, k_i and g_i smooth functions of Θ. Where all k_i are zero,
the force is continuous. Else it jumps: E has kinks. If k_i is never below zero, the force pulls
back to g_i = 0, and E has a valley there. If it is never above zero, the force pushes away, and E
has a ridge: min(k_i g_i, 0) is then in place of max(k_i g_i, 0). E₀ and h_i may depend on own
states too.
"""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from rbstab.analysis.configuration import Configurations
from rbstab.analysis.proof.formulas.program import (
    LENGTH,
    SQUARE_ABOVE,
    THETA,
    Operation,
    Program,
    operations_of,
    part_of,
    variables_of,
)
from rbstab.analysis.proof.formulas.signs import Signs
from rbstab.analysis.proof.formulas.terms import (
    MOST_TERMS,
    Powers,
    Term,
    Terms,
    meant,
    times,
    without,
)
from rbstab.analysis.proof.traced.regular import has_values
from rbstab.analysis.proof.traced.tracing import (
    NotRecordedError,
    index_in,
    traced_motion,
    variables,
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

MODE = "mode"
"""The kind of a variable σ_i."""

MOST_MODES = 6
"""The most switches of one element: a guard on both sides of each angle has so many. With n of
them, an element is recorded 2ⁿ times."""

NOT_OF_ANGLES = (
    "it switches, and its energy or an event function depends on more than Θ (and, for the energy, "
    "its own states, or its own states and X)"
)

JUMPS_BY_MORE = (
    "its force jumps at a switch, and the factor of the mode and its event function in `stored` "
    "depends on more than Θ"
)

WITHOUT_VALUES = "it is not shown that its event functions have values at all attitudes"

NOT_CONTINUOUS = (
    "each term of `stored` with a mode must have just one mode, and its event function, or the "
    "square of it, as another factor: then the energy is continuous at the switch"
)

SIGN_UNKNOWN = (
    "its force jumps at a switch, and it is not seen from `stored` whether it pulls back to it or "
    "pushes away from it everywhere (whether the factor of the mode and its event function is "
    "never negative, or never positive)"
)

TOO_LONG_NUMBERS = "the numbers in the terms of its energy have too many digits"

PART, MOST_PARTS = 10**15, 10
"""The parts of a whole number are below this; a number has at most so many and one."""


class NotShownError(Exception):
    """It is not shown that an energy is of this form; the text says why."""


class SwitchedEnergy(NamedTuple):
    """The energy of an element that switches: F + Σ max(h_i, 0) + Σ min(h_j, 0).

    Attributes:
        smooth: F, which has a continuous gradient.
        valleys: The h_i, where the force jumps and pulls back.
        ridges: The h_j, where it jumps and pushes away.
    """

    smooth: Program
    valleys: tuple[Program, ...]
    ridges: tuple[Program, ...]


def switched_energy(at_rest: Configurations, element: Element) -> SwitchedEnergy:
    """Return the energy of an element that switches.

    Args:
        at_rest: The configurations of its system, in doubles.
        element: The element.

    Raises:
        NotShownError: Something is not shown.
        NotRecordedError: Its code cannot be recorded.
    """
    try:
        operations, guards, stored, without_modes = _recorded(at_rest, element)
    except Exception as error:
        # An element of a user may raise anything.
        raise NotRecordedError(str(error) or type(error).__name__) from error
    of_guards, of_energy = (variables_of(operations, some) for some in (guards, [stored]))
    of_element = {LENGTH} if element.state_size else set[str]()
    if not (of_guards <= {THETA} and of_energy <= {THETA, MODE} | of_element):
        raise NotShownError(NOT_OF_ANGLES)
    if not has_values(operations, guards):
        raise NotShownError(WITHOUT_VALUES)
    formula, valleys, ridges = list(operations), list[Program](), list[Program]()
    total = without_modes
    by_mode = _by_mode(operations, guards, stored)
    for place, terms in _merged(operations, guards, by_mode):
        # k max(-g, 0) = k max(g, 0) - k g.
        factor = _added(formula, [_term(formula, term) for term in terms])
        total = _appended(formula, ADD, total, _appended(formula, MULTIPLY, factor, guards[place]))
    for (place, exponent), terms in by_mode.items():
        factor = _added(formula, [_term(formula, term) for term in terms])
        if exponent == 1:
            kinks = valleys if _is_valley(formula, factor) else ridges
            kink = part_of(formula, _appended(formula, MULTIPLY, factor, guards[place]))
            if not kink.of_angles:
                raise NotShownError(JUMPS_BY_MORE)
            kinks.append(kink)
            continue
        above = _appended(formula, SQUARE_ABOVE, guards[place])
        total = _appended(formula, ADD, total, _appended(formula, MULTIPLY, factor, above))
    return SwitchedEnergy(part_of(formula, total), tuple(valleys), tuple(ridges))


def _is_valley(formula: list[Operation], factor: int) -> bool:
    """Return True if a k_i is never negative (a valley), False if it is never positive (a ridge).

    Raises:
        NotShownError: Neither is shown.
    """
    if Signs(formula).never_negative(factor):
        return True
    opposite = _appended(formula, NEGATE, factor)
    if Signs(formula).never_negative(opposite):
        return False
    raise NotShownError(SIGN_UNKNOWN)


def _recorded(
    at_rest: Configurations, element: Element
) -> tuple[list[Operation], list[int], int, int]:
    """Return operations, the event functions, the energy with variable modes, and without any."""
    trace, inputs = recorded = Trace(), dict[int, Operation]()
    system, motion, own = traced_motion(at_rest, element, recorded)
    mine: Any = system.elements[at_rest.system.elements.index(element)]
    switched = replace(mine, mode=variables(recorded, MODE, element.mode_count))
    plain = replace(mine, mode=np.zeros(element.mode_count))
    guards = [index_in(trace, one) for one in switched.guards(motion, own)]
    stored, without_modes = (index_in(trace, one.stored(motion, own)) for one in (switched, plain))
    return operations_of(trace, inputs), guards, stored, without_modes


def _by_mode(
    operations: Sequence[Operation], guards: Sequence[int], stored: int
) -> dict[tuple[int, int], list[Term]]:
    """Return the terms of each h_i, as those of (i, 2), and of each k_i, as those of (i, 1).

    Raises:
        NotShownError: The energy is not of this form.
    """
    terms, sums = Terms(operations), defaultdict[Powers, Fraction](Fraction)
    signs = [_signs(operations, guard) for guard in guards]
    kept = frozenset(one for same in signs for one in same if terms.is_sum(one))
    for count, term in enumerate(terms.of(stored, kept)):
        if count > MOST_TERMS:
            raise NotShownError(NOT_CONTINUOUS)
        sums[term.powers] += term.number
    found = defaultdict[tuple[int, int], list[Term]](list)
    for powers, number in sums.items():
        modes = [one for one, _ in powers if operations[one][0] == MODE]
        others = [one for one, _ in powers if operations[one][0] != MODE]
        if others and MODE in variables_of(operations, others):
            raise NotShownError(NOT_CONTINUOUS)  # a mode inside a function, or a divisor
        if not number or not modes:
            continue
        if len(modes) > 1 or dict(powers)[modes[0]] < 1:
            raise NotShownError(NOT_CONTINUOUS)
        place = operations[modes[0]][1]
        exponent = dict(powers)[modes[0]]
        rest = times(powers, modes[0], -exponent)
        taken, term = _divided(Term(number, rest), signs[place])
        found[place, taken].append(term)
    return found


def _merged(
    operations: Sequence[Operation],
    guards: Sequence[int],
    by_mode: dict[tuple[int, int], list[Term]],
) -> list[tuple[int, list[Term]]]:
    """Put the k_i of one event function, or of g and -g, together: a surface has one kink.

    Returns:
        The places i of those with the other sign, with their k_i.
    """
    opposite = list[tuple[int, list[Term]]]()
    for place, guard in enumerate(guards):
        for first in range(place):
            sign = _signs(operations, guards[first]).get(guard)
            if sign is None or (place, 1) not in by_mode or (first, 1) not in by_mode:
                continue
            terms = by_mode.pop((place, 1))
            by_mode[first, 1] = by_mode[first, 1] + terms
            if sign < 0:
                opposite.append((place, terms))
    return opposite


def _signs(operations: Sequence[Operation], guard: int) -> dict[int, int]:
    """Return the results that are g or -g, each with its sign."""
    negative = (k for k, one in enumerate(operations) if one == (NEGATE, guard))
    found = {guard: 1} | dict.fromkeys(negative, -1)
    kind, *operands = operations[guard]
    if kind == NEGATE:
        found[operands[0]] = -1
    if kind == SUBTRACT:
        opposite = (SUBTRACT, *operands[::-1])
        found |= {k: -1 for k, one in enumerate(operations) if one == opposite}
    return found


def _divided(term: Term, signs: dict[int, int]) -> tuple[int, Term]:
    """Return a term divided by g² if it can be, else by g, and the exponent."""
    number, powers = term
    left = 2
    for one, exponent in term.powers:
        if one in signs:
            taken = min(left, max(exponent, 0))
            left -= taken
            number *= signs[one] ** taken
            powers = without(powers, [one] * taken)
    if left == 2:
        raise NotShownError(NOT_CONTINUOUS)
    return 2 - left, Term(number, powers)


def _term(formula: list[Operation], term: Term) -> int:
    """Add a product to a formula, and return its index."""
    found = exact_number(formula, term.number)
    for one, exponent in term.powers:
        factor = one if exponent == 1 else _appended(formula, POWER, one, exponent)
        found = _appended(formula, MULTIPLY, found, factor)
    return found


def exact_number(formula: list[Operation], number: Fraction) -> int:
    """Add a number, exactly: what is shown of a sum of terms may hang on its last digit."""
    try:
        double = float(number)
    except OverflowError as error:
        raise NotShownError(TOO_LONG_NUMBERS) from error
    if double and meant(double) == number:
        return _appended(formula, CONSTANT, double)
    above = _whole_number(formula, number.numerator)
    return _appended(formula, DIVIDE, above, _whole_number(formula, number.denominator))


def _whole_number(formula: list[Operation], number: int) -> int:
    """Add a whole number: by parts that are doubles."""
    rest, last = divmod(abs(number), PART)
    if rest > PART**MOST_PARTS:
        raise NotShownError(TOO_LONG_NUMBERS)
    found = _appended(formula, CONSTANT, float(last))
    if rest:
        scale = _appended(formula, CONSTANT, float(PART))
        higher = _appended(formula, MULTIPLY, _whole_number(formula, rest), scale)
        found = _appended(formula, ADD, higher, found)
    return _appended(formula, NEGATE, found) if number < 0 else found


def _added(formula: list[Operation], summands: Sequence[int]) -> int:
    total, *others = summands
    for one in others:
        total = _appended(formula, ADD, total, one)
    return total


def _appended(formula: list[Operation], *operation: Any) -> int:
    formula.append(operation)
    return len(formula) - 1
