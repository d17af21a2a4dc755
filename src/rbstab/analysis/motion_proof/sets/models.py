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
from rbstab.mechanics.numbers import Array

UNIT = 2.0**-53 * 1.001
"""A sum of n products of doubles has a rounding error of at most n times this, relative to the sum
of the absolute products, for n below 10⁹ (N. Higham, 2002, section 3.1)."""

ANGLE_TERMS = 9
"""Terms of the series of sine and of cosine in z."""


class TooWide(ArithmeticError):
    """A function has no model on a set, because the set is too wide."""


@dataclass(frozen=True, eq=False)
class Model:
    """A Taylor model.

    Args:
        space: The monomials in z.
        polynomial: The coefficients, shape (monomials, K): of z^α τᵏ.
        remainder: Shape (K,).
    """

    space: Monomials
    polynomial: Array
    remainder: Array

    @cached_property
    def size_by_degree(self) -> Array:
        """Sums of the absolute coefficients by degree in z, shape (degree + 1, K); rounded."""
        return np.add.reduceat(np.abs(self.polynomial), self.space.first_of_degree, axis=0)

    @cached_property
    def size(self) -> Array:
        """A bound on the polynomial's coefficient of each τᵏ, shape (K,)."""
        bound: Array = rounded_up(self.size_by_degree.sum(axis=0))
        return bound

    @property
    def bound(self) -> Array:
        """A bound on the coefficient of each τᵏ, shape (K,)."""
        found: Array = rounded_up(self.size + self.remainder)
        return found

    def __mul__(self, other: "Model") -> "Model":
        first, second, begins = self.space.pairs
        a, b = self.polynomial[first], other.polynomial[second]
        terms = a.shape[1]
        products = np.zeros_like(a)
        for k in range(terms):
            products[:, k:] += a[:, k : k + 1] * b[:, : terms - k]
        polynomial = np.add.reduceat(products, begins, axis=0)
        error = _convolved(self.bound, other.remainder) + _convolved(self.remainder, other.size)
        operations = terms + self.space.most_pairs + 4
        error += operations * UNIT * _convolved(self.size, other.size)
        # What has a higher degree in z: each degree of one factor with the high ones of the other.
        by_degree, high = self.size_by_degree, np.cumsum(other.size_by_degree[::-1], axis=0)
        for degree in range(1, self.space.degree + 1):
            error += _convolved(by_degree[degree], high[degree - 1])
        return Model(self.space, polynomial, rounded_up(error))

    @cached_property
    def inverse(self) -> "Model":
        """1/x.

        Raises:
            TooWide: x may be zero.
        """
        x, y = _bare(self), _constant(self, 0.0)
        with np.errstate(all="ignore"):
            y.polynomial[0, 0] = 1.0 / self.polynomial[0, 0]
            for _ in range(ceil(log2(self.polynomial.shape[1] + self.space.degree + 1))):
                y = _bare(y * _shifted(_scaled(x * y, -1.0), 2.0))
        # With e = xy - 1, 1/x = y (1 - e/(1 + e)); E bounds e, so E/(1 - E) bounds e/(1 + e).
        E = _shifted(self * y, -1.0).bound
        if not E[0] < 1.0:
            raise TooWide
        quotient = rounded_up(_convolved(E, _geometric(E)))
        return Model(self.space, y.polynomial, rounded_up(_convolved(y.size, quotient)))

    @cached_property
    def sine_and_cosine(self) -> "tuple[Model, Model]":
        """sin x and cos x.

        W = c + is, with polynomials s and c, follows W' = ix'W + δ. So W and e^{ix} differ by
        e^{ix} (W(0)e^{-ix(0)} - 1 + ∫ δe^{-ix}), and |e^{ix(0)}| = 1.
        """
        at_start = _cut(self, 1)
        sine, cosine = _angle_functions(at_start)
        apart = sine.remainder + cosine.remainder
        s, c = _rotated(self, sine.polynomial[:, 0], cosine.polynomial[:, 0])
        terms = self.polynomial.shape[1]
        error = np.zeros(terms)
        error[0] = apart[0]
        x = _bare(self)
        M = _exponential(x.size)
        if terms > 1:
            rate = _derivative(x)
            short_s, short_c = _cut(s, terms - 1), _cut(c, terms - 1)
            defects = (
                _sum(_derivative(s), _scaled(rate * short_c, -1.0)),
                _sum(_derivative(c), rate * short_s),
            )
            delta = rounded_up(defects[0].bound + defects[1].bound)
            error[1:] = _convolved(delta, M[: terms - 1]) / np.arange(1, terms)
        # e^{i(x + r)} - e^{ix} = e^{ix} (e^{ir} - 1)
        disturbed = _exponential(self.remainder)
        disturbed[0] = self.remainder[0]
        error = rounded_up(_convolved(M, rounded_up(error + disturbed)))
        return Model(self.space, s.polynomial, error), Model(self.space, c.polynomial, error)


def model(space: Monomials, polynomial: Array, remainder: Array) -> Model:
    """Return a model; see `Model`."""
    return Model(space, polynomial, remainder)


def combination(
    space: Monomials, form: "ConstantFactors", models: list[Model], terms: int
) -> Model:
    """Return a sum of models with constant factors, plus a constant."""
    polynomial, error = np.zeros((len(space), terms)), np.zeros(terms)
    polynomial[0, 0] = form.constant
    size = np.zeros(terms)
    size[0] = abs(form.constant)
    for factor, radius, one in zip(form.factors, form.radii, models, strict=True):
        polynomial += factor * one.polynomial
        error += abs(factor) * one.remainder + radius * one.bound
        size += abs(factor) * one.size
    error += (len(models) + 3) * UNIT * size
    error[0] += form.constant_radius
    return Model(space, polynomial, rounded_up(error))


@dataclass(frozen=True, eq=False)
class ConstantFactors:
    """The factors of a form as doubles, with bounds on their distances from the balls."""

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
    from flint import arb

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

    Raises:
        TooWide: A function has no model on this set.
    """
    space, terms = variables[0].space, variables[0].polynomial.shape[1]
    known: dict[int, Model] = {}

    def value(form: ConstantFactors) -> Model:
        if form.is_node:
            return known[form.nodes[0]]
        return combination(space, form, [known[node] for node in form.nodes], terms)

    with np.errstate(all="ignore"):  # a number that is not finite fails every later test
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


def _convolved(a: Array, b: Array) -> Array:
    return np.convolve(a, b)[: len(a)]


def _bare(one: Model) -> Model:
    return Model(one.space, one.polynomial, np.zeros(one.polynomial.shape[1]))


def _constant(like: Model, value: float) -> Model:
    polynomial = np.zeros_like(like.polynomial)
    polynomial[0, 0] = value
    return Model(like.space, polynomial, np.zeros(polynomial.shape[1]))


def _scaled(one: Model, factor: float) -> Model:
    """Multiply by ±1, without rounding."""
    return Model(one.space, factor * one.polynomial, one.remainder)


def _sum(one: Model, other: Model) -> Model:
    error = one.remainder + other.remainder + 2 * UNIT * (one.size + other.size)
    return Model(one.space, one.polynomial + other.polynomial, rounded_up(error))


def _shifted(one: Model, constant: float) -> Model:
    return _sum(one, _constant(one, constant))


def _cut(one: Model, terms: int) -> Model:
    return Model(one.space, one.polynomial[:, :terms], one.remainder[:terms])


def _derivative(one: Model) -> Model:
    """The derivative by τ of a model without remainders."""
    factors = np.arange(1, one.polynomial.shape[1])
    polynomial = one.polynomial[:, 1:] * factors
    size = rounded_up(one.size[1:] * factors)
    return Model(one.space, polynomial, rounded_up(2 * UNIT * size))


def _geometric(E: Array) -> Array:
    """Bound the coefficients of 1/(1 - E), for E(0) < 1."""
    found = np.zeros(len(E))
    first = rounded_up(1.0 / np.nextafter(1.0 - E[0], 0.0))
    found[0] = first
    for k in range(1, len(E)):
        found[k] = rounded_up(rounded_up(E[1 : k + 1] @ found[k - 1 :: -1][:k]) * first)
    return found


def _exponential(size: Array) -> Array:
    """Bound the coefficients of e^X, where `size` bounds those of X from τ on and X(0) is 0."""
    found = np.zeros(len(size))
    found[0] = 1.0
    weighted = np.arange(len(size)) * size
    for k in range(1, len(size)):
        found[k] = rounded_up(weighted[1 : k + 1] @ found[k - 1 :: -1][:k]) / k
    return rounded_up(found)


def _angle_functions(x: Model) -> tuple[Model, Model]:
    """Return the sine and the cosine of a model without τ; its remainder is left out."""
    from flint import arb

    middle = float(x.polynomial[0, 0])
    u = _shifted(_bare(x), -middle)
    u.polynomial[0, 0] = 0.0
    sine, cosine = (middle_and_radius(one) for one in arb(middle).sin_cos())
    square = u * u
    even, odd = _constant(u, 1.0), _constant(u, 1.0)
    for k in range(ANGLE_TERMS, 0, -1):
        even = _shifted(_divided(square * even, -2 * k * (2 * k - 1)), 1.0)
        odd = _shifted(_divided(square * odd, -2 * k * (2 * k + 1)), 1.0)
    odd = odd * u
    rest = _rest_of_series(float(u.bound[0]))
    even, odd = (Model(one.space, one.polynomial, one.remainder + rest) for one in (even, odd))

    def turned(by_even: tuple[float, float], by_odd: tuple[float, float]) -> Model:
        factors = ConstantFactors(
            (0, 1), (by_even[0], by_odd[0]), (by_even[1], by_odd[1]), 0.0, 0.0
        )
        return combination(u.space, factors, [even, odd], 1)

    return turned(sine, cosine), turned(cosine, (-sine[0], sine[1]))


def _rest_of_series(u: float) -> float:
    """Bound the terms of the series of sine and cosine from the first that is left out."""
    if not u < 2.0:
        raise TooWide
    term = 1.0
    for k in range(1, 2 * ANGLE_TERMS + 3):
        term = term * u / k
    return float(rounded_up(2.0 * term))


def _divided(one: Model, divisor: int) -> Model:
    size = one.size / abs(divisor)
    error = one.remainder / abs(divisor) + 2 * UNIT * rounded_up(size)
    return Model(one.space, one.polynomial / divisor, rounded_up(error))


def _rotated(x: Model, sine: Array, cosine: Array) -> tuple[Model, Model]:
    """Return polynomials near sin x and cos x, from those at τ = 0: s' = x'c and c' = -x's."""
    first, second, begins = x.space.pairs
    terms = x.polynomial.shape[1]
    rates = (x.polynomial * np.arange(terms))[first]
    s, c = np.zeros_like(x.polynomial), np.zeros_like(x.polynomial)
    s[:, 0], c[:, 0] = sine, cosine
    for k in range(1, terms):
        weights = rates[:, 1 : k + 1]
        of_s = np.einsum("pl,pl->p", weights, c[second, :k][:, ::-1])
        of_c = np.einsum("pl,pl->p", weights, s[second, :k][:, ::-1])
        s[:, k] = np.add.reduceat(of_s, begins) / k
        c[:, k] = -np.add.reduceat(of_c, begins) / k
    return _bare(Model(x.space, s, x.remainder)), _bare(Model(x.space, c, x.remainder))
