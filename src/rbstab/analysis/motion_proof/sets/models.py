"""Taylor models: polynomials in τ and z with proved bounds on what they miss, for |z_i| <= 1.

A model stands for a function of τ and z, as a power series in τ. For each z, its coefficient of τᵏ
differs from that of the polynomial by at most the k-th remainder. Terms of a higher degree in z,
and all rounding errors, go into the remainders.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from math import ceil, log2

import numpy as np

from rbstab.analysis.motion_proof.rounding import middle_and_radius, rounded_up
from rbstab.analysis.motion_proof.sets.graph import (
    INVERSE,
    PRODUCT,
    SINE,
    VARIABLE,
    Form,
    Graph,
)
from rbstab.analysis.motion_proof.sets.monomials import Monomials
from rbstab.analysis.proof.trigonometric import rigorous_basis
from rbstab.mechanics.numbers import Array

UNIT = 2.0**-53 * 1.001
"""A sum of n products of doubles has a rounding error of at most n times this, relative to the sum
of the absolute products, for n below 10⁹ (N. Higham, 2002, section 3.1)."""

ANGLE_TERMS = 9
"""Terms of the series of sine and of cosine in z."""


@dataclass(frozen=True, eq=False)
class Model:
    """A Taylor model, or many at once: all arrays may have further axes in front.

    A remainder that is not finite is no bound.

    Args:
        space: The monomials in z.
        polynomial: The coefficients, shape (..., monomials, K): of z^α τᵏ.
        remainder: Shape (..., K).
    """

    space: Monomials
    polynomial: Array
    remainder: Array

    @cached_property
    def size_by_degree(self) -> Array:
        """Sums of the absolute coefficients by degree in z, shape (..., degree + 1, K); rounded."""
        return np.add.reduceat(np.abs(self.polynomial), self.space.first_of_degree, axis=-2)

    @cached_property
    def size(self) -> Array:
        """A bound on the polynomial's coefficient of each τᵏ, shape (..., K)."""
        bound: Array = rounded_up(self.size_by_degree.sum(axis=-2))
        return bound

    @cached_property
    def bound(self) -> Array:
        """A bound on the coefficient of each τᵏ, shape (..., K)."""
        found: Array = rounded_up(self.size + self.remainder)
        return found

    def __mul__(self, other: "Model") -> "Model":
        terms = self.polynomial.shape[-1]
        polynomial = _product(self.space, self.polynomial, other.polynomial)
        operations = terms + self.space.most_pairs + 4
        by_size = other.remainder + operations * UNIT * other.size
        # What has a higher degree in z: each degree of one factor with the high ones of the other.
        degrees = range(1, self.space.degree + 1)
        high = np.cumsum(other.size_by_degree[..., ::-1, :], axis=-2)
        ones = [self.size, self.remainder, *(self.size_by_degree[..., k, :] for k in degrees)]
        others = [by_size, other.bound, *(high[..., k - 1, :] for k in degrees)]
        error = convolved(np.stack(ones), np.stack(others)).sum(axis=0)
        return Model(self.space, polynomial, rounded_up(error))

    @cached_property
    def inverse(self) -> "Model":
        """1/x. The remainder is infinite where x may be zero."""
        x, y = _bare(self), _constant(self, 0.0)
        y.polynomial[..., 0, 0] = 1.0 / self.polynomial[..., 0, 0]
        for _ in range(ceil(log2(self.polynomial.shape[-1] + self.space.degree + 1))):
            correction = -_product(self.space, x.polynomial, y.polynomial)
            correction[..., 0, 0] += 2.0
            y = _bare(Model(x.space, _product(x.space, y.polynomial, correction), y.remainder))
        # With e = xy - 1, 1/x = y (1 - e/(1 + e)); E bounds e, so E/(1 - E) bounds e/(1 + e).
        E = _shifted(self * y, -1.0).bound
        quotient = rounded_up(convolved(E, _geometric(E)))
        return Model(self.space, y.polynomial, rounded_up(convolved(y.size, quotient)))

    @cached_property
    def sine_and_cosine(self) -> "tuple[Model, Model]":
        """sin x and cos x.

        W = c + is, with polynomials s and c, follows W' = ix'W + δ. So W and e^{ix} differ by
        e^{ix} (W(0)e^{-ix(0)} - 1 + ∫ δe^{-ix}), and |e^{ix(0)}| = 1.
        """
        sine, cosine = _angle_functions(_cut(self, 1))
        s, c = _rotated(self, sine.polynomial[..., 0], cosine.polynomial[..., 0])
        terms = self.polynomial.shape[-1]
        error = np.zeros_like(self.remainder)
        error[..., :1] = sine.remainder + cosine.remainder
        x = _bare(self)
        M = _exponential(x.size)
        if terms > 1:
            rate = _derivative(x)
            short_s, short_c = _cut(s, terms - 1), _cut(c, terms - 1)
            defects = (
                _sum(_derivative(s), _negative(rate * short_c)),
                _sum(_derivative(c), rate * short_s),
            )
            delta = rounded_up(defects[0].bound + defects[1].bound)
            error[..., 1:] = convolved(delta, M[..., : terms - 1]) / np.arange(1, terms)
        # e^{i(x + r)} - e^{ix} = e^{ix} (e^{ir} - 1)
        disturbed = _exponential(self.remainder)
        disturbed[..., 0] = self.remainder[..., 0]
        error = rounded_up(convolved(M, rounded_up(error + disturbed)))
        return Model(self.space, s.polynomial, error), Model(self.space, c.polynomial, error)


def combination(form: "ConstantFactors", models: list[Model], like: Model) -> Model:
    """Return a sum of models with constant factors, plus a constant.

    Args:
        form: The factors and the constant.
        models: The models of its nodes.
        like: A model with the shape of the result.
    """
    polynomial, error = np.zeros_like(like.polynomial), np.zeros_like(like.remainder)
    polynomial[..., 0, 0] = form.constant
    size = np.zeros_like(error)
    size[..., 0] = abs(form.constant)
    for factor, radius, one in zip(form.factors, form.radii, models, strict=True):
        polynomial += factor * one.polynomial
        error += abs(factor) * one.remainder + radius * one.bound
        size += abs(factor) * one.size
    error += (len(models) + 3) * UNIT * size
    error[..., 0] += form.constant_radius
    return Model(like.space, polynomial, rounded_up(error))


@dataclass(frozen=True, eq=False)
class ConstantFactors:
    """The factors of a form as doubles, with bounds on their distances from the exact ones."""

    nodes: tuple[int, ...]
    factors: tuple[float, ...]
    radii: tuple[float, ...]
    constant: float
    constant_radius: float

    @property
    def is_node(self) -> bool:
        """Whether the form is a node by itself."""
        alone = self.factors == (1.0,) and self.radii == (0.0,)
        return alone and self.constant == 0.0 and self.constant_radius == 0.0


def constant_factors(form: Form) -> ConstantFactors:
    """Return the factors of a form as doubles."""
    from flint import arb  # imported late: most runs need no balls

    pairs = [middle_and_radius(arb(factor)) for factor in form.terms.values()]
    return ConstantFactors(
        tuple(form.terms),
        tuple(middle for middle, _ in pairs),
        tuple(radius for _, radius in pairs),
        *middle_and_radius(arb(form.constant)),
    )


@dataclass(frozen=True, eq=False)
class Program:
    """What is needed to compute some forms of a graph: nodes in order, and the results.

    Args:
        steps: The number, the kind and the operands of each node.
        results: The forms.
    """

    steps: tuple[tuple[int, str, tuple[ConstantFactors, ...]], ...]
    results: tuple[ConstantFactors, ...]


def program(graph: Graph, forms: Iterable[Form]) -> Program:
    """Return the program of some forms of a graph."""
    forms = tuple(forms)
    wanted: set[int] = set()
    pending = [node for form in forms for node in form.terms]
    while pending:
        node = pending.pop()
        if node in wanted:
            continue
        wanted.add(node)
        pending += [other for one in graph.nodes[node].operands for other in one.terms]
    steps = tuple(
        (node, graph.nodes[node].kind, tuple(map(constant_factors, graph.nodes[node].operands)))
        for node in sorted(wanted)
    )
    return Program(steps, tuple(map(constant_factors, forms)))


def evaluated(program: Program, variables: list[Model]) -> list[Model]:
    """Return the models of a program's forms.

    Args:
        program: The program.
        variables: The models of the graph's variables, which are its first nodes.
    """
    known: dict[int, Model] = {}

    def value(form: ConstantFactors) -> Model:
        if form.is_node:
            return known[form.nodes[0]]
        return combination(form, [known[node] for node in form.nodes], variables[0])

    with np.errstate(all="ignore"):  # a remainder that is not finite is no bound
        for node, kind, operands in program.steps:
            if kind == VARIABLE:
                known[node] = variables[node]
            elif kind == PRODUCT:
                known[node] = value(operands[0]) * value(operands[1])
            elif kind == INVERSE:
                known[node] = value(operands[0]).inverse
            else:
                known[node] = value(operands[0]).sine_and_cosine[0 if kind == SINE else 1]
        return [value(form) for form in program.results]


def convolved(a: Array, b: Array) -> Array:
    """Return the coefficients of the product of two series in τ, as many as each has."""
    terms = a.shape[-1]
    # With τ as the first axis, the inner loops are long.
    first, second = (np.ascontiguousarray(one.reshape(-1, terms).T) for one in (a, b))
    found = first[0] * second
    for k in range(1, terms):
        found[k:] += first[k] * second[: terms - k]
    return found.T.reshape(a.shape)


def _product(space: Monomials, a: Array, b: Array) -> Array:
    """Multiply two polynomials; terms of a higher degree in z are dropped."""
    first, second, begins = space.pairs
    if len(first) == 1:
        return convolved(a, b)
    a, b = a[..., first, :], b[..., second, :]
    return np.add.reduceat(convolved(a, b), begins, axis=-2)


def _bare(one: Model) -> Model:
    return Model(one.space, one.polynomial, np.zeros_like(one.remainder))


def _constant(like: Model, value: float) -> Model:
    polynomial = np.zeros_like(like.polynomial)
    polynomial[..., 0, 0] = value
    return Model(like.space, polynomial, np.zeros_like(like.remainder))


def _negative(one: Model) -> Model:
    return Model(one.space, -one.polynomial, one.remainder)


def _sum(one: Model, other: Model) -> Model:
    error = one.remainder + other.remainder + 2 * UNIT * (one.size + other.size)
    return Model(one.space, one.polynomial + other.polynomial, rounded_up(error))


def _shifted(one: Model, constant: float) -> Model:
    return _sum(one, _constant(one, constant))


def _cut(one: Model, terms: int) -> Model:
    return Model(one.space, one.polynomial[..., :terms], one.remainder[..., :terms])


def _derivative(one: Model) -> Model:
    """The derivative by τ of a model without remainders."""
    factors = np.arange(1, one.polynomial.shape[-1])
    polynomial = one.polynomial[..., 1:] * factors
    size = rounded_up(one.size[..., 1:] * factors)
    return Model(one.space, polynomial, rounded_up(2 * UNIT * size))


def _geometric(E: Array) -> Array:
    """Bound the coefficients of 1/(1 - E); they are infinite unless E(0) < 1."""
    found = np.zeros_like(E)
    first = rounded_up(1.0 / np.nextafter(1.0 - E[..., 0], 0.0))
    found[..., 0] = np.where(E[..., 0] < 1.0, first, np.inf)
    for k in range(1, E.shape[-1]):
        found[..., k] = rounded_up(_next(E, found, k) * found[..., 0])
    return found


def _next(a: Array, b: Array, k: int) -> Array:
    """Return a_1 b_(k-1) + ... + a_k b_0, rounded up."""
    total: Array = rounded_up((a[..., 1 : k + 1] * b[..., :k][..., ::-1]).sum(axis=-1))
    return total


def _exponential(size: Array) -> Array:
    """Bound the coefficients of e^X, where `size` bounds those of X from τ on and X(0) is 0."""
    found = np.zeros_like(size)
    found[..., 0] = 1.0
    weighted = np.arange(size.shape[-1]) * size
    for k in range(1, size.shape[-1]):
        found[..., k] = _next(weighted, found, k) / k
    bound: Array = rounded_up(found)
    return bound


def _angle_functions(x: Model) -> tuple[Model, Model]:
    """Return the sine and the cosine of a model without τ; its remainder is left out."""
    middle = x.polynomial[..., 0, 0]
    u = _bare(Model(x.space, x.polynomial.copy(), x.remainder))
    u.polynomial[..., 0, 0] = 0.0
    finite = np.isfinite(middle)
    basis = rigorous_basis(np.where(finite, middle, 0.0), 1)
    cosine, sine = (np.where(finite, basis[..., k], np.nan) for k in (1, 2))
    if x.space.degree == 0:
        even, odd = _constant(u, 1.0), u
    else:
        even, odd = _series_of_angle(u)
    return _turned(even, odd, sine, cosine), _turned(even, odd, cosine, -sine)


def _series_of_angle(u: Model) -> tuple[Model, Model]:
    """Return cos u and sin u."""
    square = u * u
    even, odd = _constant(u, 1.0), _constant(u, 1.0)
    for k in range(ANGLE_TERMS, 0, -1):
        even = _shifted(_divided(square * even, -2 * k * (2 * k - 1)), 1.0)
        odd = _shifted(_divided(square * odd, -2 * k * (2 * k + 1)), 1.0)
    odd = odd * u
    rest = _rest_of_series(u.bound)
    even, odd = (Model(one.space, one.polynomial, one.remainder + rest) for one in (even, odd))
    return even, odd


def _turned(even: Model, odd: Model, by_even: Array, by_odd: Array) -> Model:
    """Return even and odd times numbers, each within `UNIT` of its exact value."""
    by_even, by_odd = by_even[..., np.newaxis, np.newaxis], by_odd[..., np.newaxis, np.newaxis]
    polynomial = even.polynomial * by_even + odd.polynomial * by_odd
    # The numbers are at most 1; four roundings.
    error = even.remainder + odd.remainder + 5 * UNIT * (even.bound + odd.bound)
    return Model(even.space, polynomial, rounded_up(error))


def _rest_of_series(u: Array) -> Array:
    """Bound the terms of the series of sine and cosine from the first that is left out."""
    term = np.ones_like(u)
    for k in range(1, 2 * ANGLE_TERMS + 3):
        term = term * u / k
    return np.where(u < 2.0, rounded_up(2.0 * term), np.inf)


def _divided(one: Model, divisor: int) -> Model:
    size = one.size / abs(divisor)
    error = one.remainder / abs(divisor) + 2 * UNIT * rounded_up(size)
    return Model(one.space, one.polynomial / divisor, rounded_up(error))


def _rotated(x: Model, sine: Array, cosine: Array) -> tuple[Model, Model]:
    """Return polynomials near sin x and cos x, from those at τ = 0: s' = x'c and c' = -x's."""
    first, second, begins = x.space.pairs
    terms = x.polynomial.shape[-1]
    rates = (x.polynomial * np.arange(terms))[..., first, :]
    s, c = np.zeros_like(x.polynomial), np.zeros_like(x.polynomial)
    s[..., 0], c[..., 0] = sine, cosine
    for k in range(1, terms):
        weights = rates[..., 1 : k + 1]
        of_s = (weights * c[..., second, :k][..., ::-1]).sum(axis=-1)
        of_c = (weights * s[..., second, :k][..., ::-1]).sum(axis=-1)
        s[..., k] = np.add.reduceat(of_s, begins, axis=-1) / k
        c[..., k] = -np.add.reduceat(of_c, begins, axis=-1) / k
    return _bare(Model(x.space, s, x.remainder)), _bare(Model(x.space, c, x.remainder))
