"""A polynomial in τ and z near the motions from a set of starts, in plain double precision.

What it misses is bounded afterwards, so its rounding errors need no bounds. All arrays may have
further axes in front: many sets at once.
"""

import numpy as np

from rbstab.analysis.motion_proof.sets.graph import INVERSE, PRODUCT, SINE, VARIABLE
from rbstab.analysis.motion_proof.sets.models import ConstantFactors, Program
from rbstab.analysis.motion_proof.sets.monomials import Monomials
from rbstab.mechanics.numbers import Array


class _Row:
    """The coefficients of one form, shape (..., monomials, order + 1), filled order by order."""

    def __init__(self, form: ConstantFactors, nodes: list[Array], shape: tuple[int, ...]) -> None:
        self.form = form
        self.nodes = nodes
        self.values = nodes[0] if form.is_node else np.zeros(shape)

    def fill(self, k: int) -> None:
        """Compute the coefficients of τᵏ from those of the nodes."""
        if self.form.is_node:
            return
        pairs = zip(self.form.factors, self.nodes, strict=True)
        self.values[..., k] = sum(factor * node[..., k] for factor, node in pairs)
        if k == 0:
            self.values[..., 0, 0] += self.form.constant


class Series:
    """The Taylor series of the motions from a set of starts.

    Args:
        program: The rates as functions of the states.
        space: The monomials in z.
        order: The highest power of τ.
    """

    def __init__(self, program: Program, space: Monomials, order: int) -> None:
        self.program, self.space, self.order = program, space, order

    def of(self, start: Array, h: Array) -> Array:
        """Return the coefficients of the states.

        Args:
            start: The states at τ = 0, shape (..., n, monomials).
            h: The length of a step, shape (...), s; τ = t/h.

        Returns:
            Shape (..., n, monomials, order + 1).
        """
        n = start.shape[-2]
        shape = (*start.shape[:-2], len(self.space), self.order + 1)
        nodes = {node: np.zeros(shape) for node, _, _ in self.program.steps}
        states = [np.zeros(shape) for _ in range(n)]
        for i, values in enumerate(states):
            values[..., 0] = start[..., i, :]
            nodes[i] = values

        def row(form: ConstantFactors) -> _Row:
            return _Row(form, [nodes[node] for node in form.nodes], shape)

        steps = [
            (kind, nodes[node], [row(form) for form in operands])
            for node, kind, operands in self.program.steps
            if kind != VARIABLE
        ]
        results = [row(form) for form in self.program.results]
        angles: dict[int, tuple[Array, Array]] = {}
        for k in range(self.order):
            for kind, values, operands in steps:
                for operand in operands:
                    operand.fill(k)
                self._fill(kind, values, [operand.values for operand in operands], k, angles)
            for i, result in enumerate(results):
                result.fill(k)
                states[i][..., k + 1] = h[..., np.newaxis] * result.values[..., k] / (k + 1)
        return np.stack(states, axis=-3)

    def _fill(
        self,
        kind: str,
        values: Array,
        operands: list[Array],
        k: int,
        angles: dict[int, tuple[Array, Array]],
    ) -> None:
        if kind == PRODUCT:
            a, b = operands
            values[..., k] = self._product(a[..., : k + 1], b[..., : k + 1])
        elif kind == INVERSE:
            (x,) = operands
            if k == 0:
                values[..., 0] = self._inverse(x[..., 0])
            else:
                rest = self._product(x[..., 1 : k + 1], values[..., :k])
                values[..., k] = -self._of_numbers(values[..., 0], rest)
        else:
            (x,) = operands
            sine, cosine = angles.setdefault(id(x), (np.zeros_like(x), np.zeros_like(x)))
            if kind == SINE or not np.any(cosine[..., k]):
                self._fill_angle(x, sine, cosine, k)
            values[..., k] = (sine if kind == SINE else cosine)[..., k]

    def _fill_angle(self, x: Array, sine: Array, cosine: Array, k: int) -> None:
        if k == 0:
            sine[..., 0], cosine[..., 0] = self._angle_functions(x[..., 0])
            return
        rates = x[..., 1 : k + 1] * np.arange(1, k + 1)
        sine[..., k] = self._product(rates, cosine[..., :k]) / k
        cosine[..., k] = -self._product(rates, sine[..., :k]) / k

    def _product(self, a: Array, b: Array) -> Array:
        """Return the coefficient of the highest power of τ in a product, shape (..., monomials)."""
        first, second, begins = self.space.pairs
        if len(first) == 1:
            found: Array = (a * b[..., ::-1]).sum(axis=-1)
            return found
        products = np.einsum("...pl,...pl->...p", a[..., first, :], b[..., second, ::-1])
        reduced: Array = np.add.reduceat(products, begins, axis=-1)
        return reduced

    def _of_numbers(self, a: Array, b: Array) -> Array:
        """Return the product of two polynomials in z."""
        return self._product(a[..., np.newaxis], b[..., np.newaxis])

    def _inverse(self, x: Array) -> Array:
        found, one = np.zeros_like(x), np.zeros_like(x)
        one[..., 0] = 1.0
        found[..., 0] = 1.0 / x[..., 0]
        for _ in range(self.space.degree):
            found = found + self._of_numbers(found, one - self._of_numbers(x, found))
        return found

    def _angle_functions(self, x: Array) -> tuple[Array, Array]:
        u = x.copy()
        u[..., 0] = 0.0
        term = np.zeros_like(u)
        term[..., 0] = 1.0
        even, odd = term.copy(), np.zeros_like(u)
        for k in range(1, self.space.degree + 1):
            term = self._of_numbers(term, u) / k
            sign = -1.0 if k % 4 in {2, 3} else 1.0
            if k % 2:
                odd = odd + sign * term
            else:
                even = even + sign * term
        s, c = np.sin(x[..., :1]), np.cos(x[..., :1])
        return s * even + c * odd, c * even - s * odd
