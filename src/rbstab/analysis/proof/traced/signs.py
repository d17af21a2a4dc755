"""Formulas that are never negative, by their form: sums and products of squares, and the like."""

from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction
from typing import NamedTuple

from rbstab.analysis.proof.traced.program import THETA, Operation
from rbstab.integrate.straight_line.number import (
    ADD,
    CONSTANT,
    DIVIDE,
    MULTIPLY,
    NEGATE,
    POWER,
    SUBTRACT,
)
from rbstab.mechanics.states import PITCH

MOST_DENOMINATOR = 1000
"""A constant of the code that is the double nearest to such a fraction means it: 1/3."""

MOST_TERMS = 10_000
"""The most terms of a sum; a formula with more of them is not shown to be anything."""

POSITIVE = frozenset({"exp", "cosh", "sqrt"})

AS_ARGUMENT = frozenset({"sinh", "tanh", "atan"})
"""Functions that have the sign of their argument."""

Powers = tuple[tuple[int, int], ...]
"""A product: the indices of its factors in rising order, each with its exponent."""


def meant(number: float) -> Fraction:
    """Return the number that a double in the code or in a config means: 1/3, or a decimal."""
    simple = Fraction(number).limit_denominator(MOST_DENOMINATOR)
    return simple if float(simple) == number else Fraction(repr(number))


class _Term(NamedTuple):
    """A number times a product."""

    number: Fraction
    powers: Powers

    @property
    def odd(self) -> list[int]:
        return [index for index, exponent in self.powers if exponent % 2]


class Signs:
    """Which results of operations are never negative.

    Args:
        operations: The operations.
    """

    def __init__(self, operations: Sequence[Operation]) -> None:
        self._operations = operations
        self._known: dict[int, bool] = {}

    def never_negative(self, index: int) -> bool:
        """Return whether a result is shown to be never negative, wherever it has a value."""
        if index not in self._known:
            try:
                self._known[index] = self._never_negative(index)
            except RecursionError:  # a formula of thousands of operations inside one another
                self._known[index] = False
        return self._known[index]

    def _never_negative(self, index: int) -> bool:
        kind, *operands = self._operations[index]
        if kind in POSITIVE:
            return True
        if kind in AS_ARGUMENT:
            return self.never_negative(operands[0])
        if kind in {CONSTANT, ADD, SUBTRACT, NEGATE, MULTIPLY, DIVIDE, POWER}:
            return self._sum(index)
        return False

    def positive(self, index: int) -> bool:
        """Return whether a result is shown to be above 0 where it has a value and |θ2| < π/2."""
        try:
            return self._positive(index)
        except RecursionError:
            return False

    def _positive(self, index: int) -> bool:
        kind, *operands = self._operations[index]
        if kind == CONSTANT:
            return float(operands[0]) > 0
        if kind == "cos":
            # The matrix B of dΘ/dt = BΩ has divisors cos θ2.
            return self._operations[operands[0]] == (THETA, PITCH)
        if kind in {"exp", "cosh"}:
            return True
        if kind == ADD:
            one, two = operands
            either = self._positive(one) or self._positive(two)
            return either and self.never_negative(one) and self.never_negative(two)
        if kind in {MULTIPLY, DIVIDE, POWER, "sqrt"}:
            factors = operands[:1] if kind == POWER else operands
            return all(map(self._positive, factors)) or self._is_square(index)
        return False

    def _is_square(self, index: int) -> bool:
        """Return whether a result is the square of a number other than 0."""
        number, powers = self._product(index)
        return number > 0 and not powers

    def _sum(self, index: int) -> bool:
        """Return whether a sum of terms is never negative: term by term, or by quadratic forms.

        A form is Σ m_ij x_i x_j times the rest of its products, which is never negative.
        """
        sums = defaultdict[Powers, Fraction](Fraction)
        for count, term in enumerate(self._terms(index)):
            if count > MOST_TERMS:
                return False
            sums[term.powers] += term.number
        terms = [_Term(number, powers) for powers, number in sums.items() if number]
        forms: dict[Powers, dict[tuple[int, int], Fraction]] = {}
        for term in terms:
            if self._alone(term):
                continue
            unknown = [index for index in term.odd if not self._factor(index)]
            if len(unknown) != 2:
                return False
            i, j = unknown
            forms.setdefault(_without(term.powers, (i, j)), {})[i, j] = term.number / 2
        for rest, form in forms.items():
            for i in {index for pair in form for index in pair}:
                square = _times(rest, i, 2)
                form[i, i] = Fraction(sums.pop(square, 0))
        return all(_is_semidefinite(form) for form in forms.values())

    def _alone(self, term: _Term) -> bool:
        """Return whether a term is never negative by itself, as x², exp(x) or x tanh(x) is."""
        positive, odd = term.number >= 0, set[int]()
        pending = term.odd
        while pending:
            index = pending.pop()
            kind, *operands = self._operations[index]
            if kind in AS_ARGUMENT:
                # It has the sign of the product of which it is taken.
                number, powers = self._product(operands[0])
                positive = positive == (number >= 0)
                pending += _Term(number, powers).odd
            elif not self._factor(index):
                odd ^= {index}
        return positive and not odd

    def _factor(self, index: int) -> bool:
        """Return whether a factor, which is no product, is never negative."""
        kind, *_ = self._operations[index]
        return kind not in {MULTIPLY, DIVIDE, NEGATE, POWER} and self.never_negative(index)

    def _terms(self, index: int, sign: int = 1) -> Iterator[_Term]:
        """Yield the terms of a sum."""
        kind, *operands = self._operations[index]
        if kind == NEGATE:
            yield from self._terms(operands[0], -sign)
        elif kind in {ADD, SUBTRACT}:
            yield from self._terms(operands[0], sign)
            yield from self._terms(operands[1], sign if kind == ADD else -sign)
        else:
            number, powers = self._product(index)
            yield from self._expanded(_Term(sign * number, powers))

    def _expanded(self, term: _Term) -> Iterator[_Term]:
        """Yield the terms of a product some of whose factors are sums."""
        inner = [one for one, exponent in term.powers if exponent == 1 and self._is_sum(one)]
        if not inner:
            yield term
            return
        rest = _without(term.powers, inner[:1])
        for other in self._terms(inner[0]):
            found = rest
            for one, exponent in other.powers:
                found = _times(found, one, exponent)
            yield from self._expanded(_Term(term.number * other.number, found))

    def _is_sum(self, index: int) -> bool:
        return self._operations[index][0] in {ADD, SUBTRACT}

    def _product(self, index: int) -> tuple[Fraction, Powers]:
        """Return a product as a number and its factors; a divisor is one of a power below 0."""
        number, powers = Fraction(1), Counter[int]()
        pending = [(index, 1)]
        while pending:
            one, exponent = pending.pop()
            kind, *operands = self._operations[one]
            if kind == CONSTANT and operands[0]:
                number *= meant(operands[0]) ** exponent
            elif kind == CONSTANT:
                number = Fraction(0)
            elif kind == NEGATE:
                number *= (-1) ** (exponent % 2)
                pending.append((operands[0], exponent))
            elif kind in {MULTIPLY, DIVIDE}:
                second = exponent if kind == MULTIPLY else -exponent
                pending += [(operands[0], exponent), (operands[1], second)]
            elif kind == POWER:
                pending.append((operands[0], exponent * operands[1]))
            else:
                powers[one] += exponent
        return number, tuple(sorted((one, n) for one, n in powers.items() if n))


def _times(powers: Powers, index: int, exponent: int) -> Powers:
    """Return a product with one more factor."""
    found = dict(powers)
    found[index] = found.get(index, 0) + exponent
    return tuple(sorted((one, n) for one, n in found.items() if n))


def _without(powers: Powers, indices: Sequence[int]) -> Powers:
    """Return a product divided by some factors."""
    found = powers
    for index in indices:
        found = _times(found, index, -1)
    return found


def _is_semidefinite(form: Mapping[tuple[int, int], Fraction]) -> bool:
    """Return whether a quadratic form is never negative, by exact elimination."""
    places = sorted({index for pair in form for index in pair})
    rows = [[form.get((i, j), form.get((j, i), Fraction(0))) for j in places] for i in places]
    while rows:
        pivot, *row = rows[0]
        if pivot < 0 or (pivot == 0 and any(row)):
            return False
        rows = [
            [entry - (row[i] * row[j] / pivot if pivot else 0) for j, entry in enumerate(rest)]
            for i, (_, *rest) in enumerate(rows[1:])
        ]
    return True
