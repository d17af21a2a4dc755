"""Formulas that are never negative, by their form: sums and products of squares, and the like."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from fractions import Fraction

from rbstab.analysis.proof.formulas.program import THETA, Operation
from rbstab.analysis.proof.formulas.quadratic_forms import Form, is_semidefinite
from rbstab.analysis.proof.formulas.terms import (
    AS_ARGUMENT,
    MOST_TERMS,
    NO_SUMS,
    Powers,
    Term,
    Terms,
    times,
    without,
)
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

POSITIVE = frozenset({"exp", "cosh", "sqrt"})


class Signs:
    """Which results of operations are never negative.

    Args:
        operations: The operations.
    """

    def __init__(self, operations: Sequence[Operation]) -> None:
        self._operations, self._terms = operations, Terms(operations)
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
        number, powers = self._terms.product(index)
        return number > 0 and not powers

    def _sum(self, index: int) -> bool:
        """Return whether a sum of terms is never negative."""
        return self._split(index) is not None

    def _split(self, index: int) -> tuple[list[Term], Mapping[Powers, Form]] | None:
        """Return a sum as terms and quadratic forms that are never negative, or None.

        A form is Σ m_ij x_i x_j times the rest of its products, which is never negative.
        """
        for kept in dict.fromkeys([self._terms.variables, NO_SUMS]):
            found = self._split_into(index, kept - {index})
            if found is not None:
                return found
        return None

    def _split_into(
        self, index: int, kept: frozenset[int]
    ) -> tuple[list[Term], Mapping[Powers, Form]] | None:
        """Return the same, with some sums as variables of forms."""
        sums = defaultdict[Powers, Fraction](Fraction)
        for count, term in enumerate(self._terms.of(index, kept)):
            if count > MOST_TERMS:
                return None
            sums[term.powers] += term.number
        terms = [Term(number, powers) for powers, number in sums.items() if number]
        forms: dict[Powers, dict[tuple[int, int], Fraction]] = {}
        for term in terms:
            if self._alone(term):
                continue
            unknown = [index for index in term.odd if not self._factor(index)]
            if len(unknown) != 2:
                return None
            i, j = unknown
            forms.setdefault(without(term.powers, (i, j)), {})[i, j] = term.number / 2
            del sums[term.powers]
        for rest, form in forms.items():
            for i in {index for pair in form for index in pair}:
                square = times(rest, i, 2)
                form[i, i] = Fraction(sums.pop(square, 0))
        if not all(is_semidefinite(form) for form in forms.values()):
            return None
        return [Term(number, powers) for powers, number in sums.items() if number], forms

    def _alone(self, term: Term) -> bool:
        """Return whether a term is never negative by itself, as x², exp(x) or x tanh(x) is."""
        positive, odd = term.number >= 0, set[int]()
        pending = term.odd
        while pending:
            index = pending.pop()
            kind, *operands = self._operations[index]
            if kind in AS_ARGUMENT:
                # It has the sign of the product of which it is taken.
                number, powers = self._terms.product(operands[0])
                positive = positive == (number >= 0)
                pending += Term(number, powers).odd
            elif not self._factor(index):
                odd ^= {index}
        return positive and not odd

    def _factor(self, index: int) -> bool:
        """Return whether a factor, which is no product, is never negative."""
        kind, *_ = self._operations[index]
        return kind not in {MULTIPLY, DIVIDE, NEGATE, POWER} and self.never_negative(index)
