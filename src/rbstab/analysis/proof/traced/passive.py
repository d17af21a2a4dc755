"""Whether an element of a user is passive: what its recorded statements show.

Its energy must be a function of the pose and of its own states with

    d(stored)/dt + dissipated + (power of the wrench) = 0,        dissipated >= 0,

for all motions, and its wrench and rates must be smooth (`regular.py`). The first is an identity of
formulas: it is compared modulo a prime (`modular.py`). The second follows from the form of the
formula (`signs.py`).
"""

from collections.abc import Sequence

from rbstab.analysis.proof.formulas.modular import NoValueError, P, values
from rbstab.analysis.proof.formulas.program import (
    Operation,
    needed_by,
    operations_of,
    variables_of,
)
from rbstab.analysis.proof.formulas.signs import Signs
from rbstab.analysis.proof.traced.regular import has_values
from rbstab.analysis.proof.traced.tracing import TIME, VELOCITY, TracedStatements

TIMED = "a statement depends on the time"

NO_FUNCTION_OF_POSE = "`stored` depends on a velocity"

UNBALANCED = "it is not shown that `wrench` has the power that `stored` and `dissipated` state"

NO_POINTS = "its power balance has no value at the points at which it would be computed"

WITHOUT_VALUES = (
    "it is not shown that `stored`, `wrench` and `dissipated` have values for all motions: a "
    "divisor, or what a root or a logarithm is taken of, may be zero"
)

GAINS_ENERGY = "it is not shown that `dissipated` is never negative"

POINTS = 40
"""The points at which the identity is compared. At half of them the signs of square roots are such
that an error shows which is zero for other signs."""

MOST_TRIALS = 2000
"""The points that are tried: each square root must exist there, and no divisor may be 0."""


def why_not_passive(statements: TracedStatements) -> str | None:
    """Return what is not shown of an element that should be passive, or None if all is."""
    operations = operations_of(statements.trace, statements.inputs)
    stated = (statements.stored, statements.power, statements.dissipated)
    used = [*stated, *statements.rates.values()]
    if TIME in variables_of(operations, used):
        return TIMED
    if VELOCITY in variables_of(operations, stated[:1]):
        return NO_FUNCTION_OF_POSE
    balances = _balances(operations, statements)
    if balances is None:
        return NO_POINTS
    if not balances:
        return UNBALANCED
    if not has_values(operations, used):
        return WITHOUT_VALUES
    loss = statements.loss
    return None if Signs(loss.operations).never_negative(loss.result) else GAINS_ENERGY


def _balances(operations: Sequence[Operation], statements: TracedStatements) -> bool | None:
    """Return whether the powers add up to zero at all points; None without enough points."""
    at, places = statements, statements.rates
    results = (at.stored, at.power, at.dissipated, *places.values())
    needed = frozenset(needed_by(operations, results))
    compared = 0
    for point in range(MOST_TRIALS):
        try:
            still = values(operations, needed, {}, point)
            rates = {variable: still[index].value for variable, index in places.items()}
            found = values(operations, needed, rates, point)
        except NoValueError:
            continue
        spent = found[at.dissipated].value + found[at.power].value
        if (found[at.stored].rate + spent) % P:
            return False
        compared += 1
        if compared == POINTS:
            return True
    return None
