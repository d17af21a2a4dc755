"""Taylor series in τ of all nodes of a program, in plain double precision.

They begin polynomials near motions. What these miss is bounded afterwards, so the rounding errors
here need no bounds.
"""

from collections.abc import Callable

import numpy as np

from rbstab.mechanics.numbers import Array
from rbstab.proof.exact.atoms import COS, SIN
from rbstab.proof.motion.monomials import Monomials
from rbstab.proof.motion.program import INVERSE, PRODUCT, ROOT, Program, Sums

_OF_DOUBLES: dict[str, Callable[[Array], Array]] = {
    INVERSE: np.reciprocal,
    SIN: np.sin,
    COS: np.cos,
    "exp": np.exp,
    ROOT: np.sqrt,
    "log": np.log,
    "atan": np.arctan,
}


def node_series(
    program: Program, space: Monomials, given: Array, longest: Array | None = None, order: int = 0
) -> Array:
    """Return the coefficients of all nodes, shape (order + 1, nodes, sets, monomials).

    Args:
        program: The program. With `longest`, its first results are the rates of the variables.
        space: The monomials in z.
        given: Coefficients of the variables, or of them and some of the next nodes, shape (terms,
            nodes, sets, monomials).
        longest: If given, only the first coefficients of the variables are known, and the others
            follow from the rates: these are motions, τ = t/longest, in s, shape (sets,).
        order: The highest power of τ; without `longest` that of
    """
    n, terms = program.variables, len(given) if longest is None else order + 1
    values = np.zeros((terms, len(program), *given.shape[2:]))
    values[: len(given), : given.shape[1]] = given
    operations = [
        operation for operation in program.operations if operation.nodes.start >= given.shape[1]
    ]
    if not operations:
        return values
    # The argument x and the slope m of a function y: of its rates by log τ, y' = m x', and by the
    # degree in z for τ = 0. For products both factors.
    both = np.zeros((terms, 2, len(program), *given.shape[2:]))
    is_product = np.isin(np.arange(len(program)), program.of_kinds(PRODUCT))
    with np.errstate(all="ignore"):
        for _ in range(space.degree + 1):  # each time, one more degree in z is right
            for operation in operations:
                both[0, :, operation.nodes] = _pairs(operation.operands, values[0], 0)
                x, m = both[0, 0, operation.nodes], both[0, 1, operation.nodes]
                if operation.kind == PRODUCT:
                    values[0, operation.nodes] = _last(space, x[np.newaxis], m[np.newaxis])
                else:
                    rates = _last(space, (x * space.degrees)[np.newaxis], m[np.newaxis])
                    values[0, operation.nodes, ..., 1:] = rates[..., 1:] / space.degrees[1:]
                    values[0, operation.nodes, ..., 0] = _OF_DOUBLES[operation.kind](x[..., 0])
        both[0, 0] *= is_product[:, np.newaxis, np.newaxis]  # a constant has no rate
        both[0, 1, n:] = _pairs(program.operands, values[0], 0)[1]
        for k in range(1, terms):
            if longest is not None:
                rates = summed(program.results, values[k - 1], k - 1)[:n]
                values[k, :n] = longest[:, np.newaxis] * rates / k
            for operation in operations:
                weight = 1 if operation.kind == PRODUCT else k
                pairs = _pairs(operation.operands, values[k], k)
                both[k, 0, operation.nodes] = weight * pairs[0]
                both[k, 1, operation.nodes] = pairs[1]  # a slope may need later nodes: 0 so far
                last = _last(
                    space, both[: k + 1, 0, operation.nodes], both[: k + 1, 1, operation.nodes]
                )
                values[k, operation.nodes] = last / weight
            both[k, 1, n:] = _pairs(program.operands, values[k], k)[1]
    return values


def _pairs(operands: Sums, values: Array, power: int) -> Array:
    """Return the two operands of each node, shape (2, nodes, sets, monomials)."""
    return summed(operands, values, power).reshape(2, -1, *values.shape[1:])


def summed(sums: Sums, values: Array, power: int = 0) -> Array:
    """Return sums of nodes, rounded; the order of the operations is the same for many sets.

    Args:
        sums: The sums.
        values: Coefficients of the nodes, shape (..., nodes, sets, monomials): those of one power
            of τ, or of all from τ⁰ on.
        power: The power of τ of the first ones; a constant belongs to τ⁰.
    """
    parts = np.take(values, sums.places, axis=-3) * sums.factors[0][..., np.newaxis]
    total: Array = np.add.reduceat(parts, sums.begins, axis=-3)
    if power == 0:
        total[(0,) * (total.ndim - 3)][..., 0] += sums.constants[0]
    return total


def _last(space: Monomials, a: Array, b: Array) -> Array:
    """Return the coefficient of the highest power of τ in a product."""
    first, second, begins = space.pairs
    if len(first) == 1:
        last: Array = np.cumsum(a * b[::-1], axis=0)[-1]  # in order, for any number of sets
        return last
    products = (np.take(a, first, axis=-1) * np.take(b[::-1], second, axis=-1)).sum(axis=0)
    reduced: Array = np.add.reduceat(products, begins, axis=-1)
    return reduced
