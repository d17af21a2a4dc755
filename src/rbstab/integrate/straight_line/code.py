"""Python code of a trace: one function that computes its results from floats or complex numbers."""

from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any

from rbstab.integrate.straight_line.number import (
    ADD,
    CONSTANT,
    DIVIDE,
    INPUT,
    MULTIPLY,
    NEGATE,
    POWER,
    SUBTRACT,
    Operation,
    Trace,
)
from rbstab.mechanics.numbers import FUNCTIONS

FORMS = {
    ADD: "({} + {})",
    SUBTRACT: "({} - {})",
    MULTIPLY: "({} * {})",
    DIVIDE: "({} / {})",
    NEGATE: "(-{})",
    POWER: "({} ** {})",
    **{name: f"{name}({{}})" for name in FUNCTIONS},
}
"""The Python expression of each kind of operation."""

MAX_DEPTH = 20
"""The most operations inside one another in an expression; Python's parser allows about 100."""

Evaluate = Callable[[Sequence[Any]], list[Any]]
"""Computes the results from the inputs that vary."""

Prepare = Callable[[Sequence[Any], Any], Evaluate]
"""Computes all that depends on the other inputs only; its arguments are these, and a module with
the functions of one number: `math` or `cmath`."""


def compiled(trace: Trace, results: Sequence[int]) -> Prepare:
    """Return a function that prepares the evaluation of some operations of a trace.

    Operations that no result needs are left out.

    Args:
        trace: The trace.
        results: The indices of the results.
    """
    namespace: dict[str, Any] = {}
    # The text consists of numbered names, numbers and the forms above; no text of a user is in it.
    exec(compile(source(trace, results), "<straight-line code>", "exec"), namespace)  # noqa: S102
    prepare: Prepare = namespace["prepare"]
    return prepare


def source(trace: Trace, results: Sequence[int]) -> str:
    """Return the source of the function `prepare` of `compiled`."""
    operations = trace.operations
    uses = _uses(operations, results)
    expressions: dict[int, str] = {}
    depths: dict[int, int] = {}
    prepared: list[str] = []
    evaluated: list[str] = []
    for index, (kind, operands, varies) in enumerate(operations):
        if kind == INPUT:
            expressions[index] = f"x{index}"
        elif kind == CONSTANT:
            # The parentheses keep the sign of a negative constant beside another operator.
            expressions[index] = f"({operands[0]!r})"
        elif index in uses:
            form = FORMS[kind].format(*(expressions[operand] for operand in operands))
            depth = 1 + max(depths.get(operand, 0) for operand in operands)
            if uses[index] == 1 and depth < MAX_DEPTH and varies:
                expressions[index], depths[index] = form, depth
            else:
                expressions[index] = f"x{index}"
                (evaluated if varies else prepared).append(f"x{index} = {form}")
    used = {operations[index].kind for index in uses}
    inputs = [index for index, operation in enumerate(operations) if operation.kind == INPUT]
    parameters = [f"x{index}" for index in inputs if not operations[index].varies]
    variables = [f"x{index}" for index in inputs if operations[index].varies]
    lines = [
        "def prepare(parameters, functions):",
        *(f"    {name} = functions.{name}" for name in FUNCTIONS if name in used),
        f"    [{', '.join(parameters)}] = parameters",
        *(f"    {line}" for line in prepared),
        "    def evaluate(variables):",
        f"        [{', '.join(variables)}] = variables",
        *(f"        {line}" for line in evaluated),
        f"        return [{', '.join(expressions[index] for index in results)}]",
        "    return evaluate",
    ]
    return "\n".join(lines) + "\n"


def _uses(operations: Sequence[Operation], results: Sequence[int]) -> Counter[int]:
    """Return how often each operation is used by those that the results need."""
    uses = Counter(results)
    for index in range(len(operations) - 1, -1, -1):
        kind, operands, _ = operations[index]
        if uses[index] and kind not in (INPUT, CONSTANT):
            uses.update(operands)
    return uses
