"""Whether formulas of a motion have values, and are smooth, for all motions.

Only a quotient, a negative power, a root, a logarithm and a tangent may have no value. They have
one if their argument is above zero by its form. If it depends on Θ alone, and is periodic in θ1 and
θ3, bounds over boxes may show it too, for |θ2| <= π/2.
"""

from collections.abc import Collection, Sequence
from functools import lru_cache

from rbstab.analysis.proof.boxes import joined
from rbstab.analysis.proof.formulas.program import (
    THETA,
    Operation,
    Program,
    needed_by,
    part_of,
    variables_of,
)
from rbstab.analysis.proof.formulas.signs import Signs
from rbstab.analysis.proof.traced.energy import TracedEnergy
from rbstab.integrate.straight_line.number import DIVIDE, POWER

BOX_LIMIT = 20_000
"""The boxes over which the bounds of one argument are computed at most."""


def has_values(operations: Sequence[Operation], results: Collection[int]) -> bool:
    """Return whether some results are shown to have values, and to be smooth."""
    signs = Signs(operations)
    for index in needed_by(operations, results):
        risk = _risk(operations[index])
        if risk is None:
            continue
        kind, argument, *_ = risk
        if kind != "tan" and signs.positive(argument):
            continue
        of_angles = variables_of(operations, [argument]) <= {THETA}
        if not (of_angles and _known_everywhere(part_of([*operations, risk], len(operations)))):
            return False
    return True


def _risk(operation: Operation) -> Operation | None:
    """Return the part of an operation that may have no value; None if there is none."""
    kind, *operands = operation
    if kind == DIVIDE:
        return (POWER, operands[1], -1)
    if kind in {"sqrt", "log", "tan"} or (kind == POWER and operands[1] < 0):
        return operation
    return None


@lru_cache(64)  # a proof asks for the same formulas several times
def _known_everywhere(program: Program) -> bool:
    """Return whether a formula of Θ has bounds in all of the range, by bisection."""
    if not program.periodic:
        return False
    formula = TracedEnergy("", program)
    pending, examined = formula.cells, 0
    while len(pending):
        examined += len(pending)
        if examined > BOX_LIMIT:
            return False
        left = pending[~formula.has_bounds(pending)]
        pending = joined([left.halves(left.radius.argmax(axis=1))])
    return True
