"""Rewriting of expressions: others in place of atoms, steps that are known, coefficients."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from fractions import Fraction
from functools import cache, reduce
from typing import NamedTuple

from rbstab.proof.exact.atoms import (
    COS,
    INNER,
    LET,
    OF,
    POSITIVE,
    SIN,
    STEP,
    VAR,
    Atom,
    Monomial,
    monomial,
)
from rbstab.proof.exact.expr import (
    Expr,
    as_factor,
    atom,
    expr,
    mapped,
    only,
    product,
    same_function,
    summed,
    variable,
    variable_of,
)

PLAIN = frozenset({VAR, STEP, POSITIVE})


def substituted(e: Expr, given: Mapping[Atom, Expr]) -> Expr:
    """Put expressions in place of atoms, also inside functions."""
    if not given:
        return e
    numbers = frozenset[int]().union(*(a.variables for a in given))

    @cache
    def change(a: Atom, p: int) -> Expr:
        if a in given:
            return (given[a] if p <= 2 else as_factor(given[a])) ** p
        inside = a.kind != VAR and a.variables & numbers
        return (same_function(a, substituted(a.inner, given)) if inside else only(a)) ** p

    return mapped(e, change)


def with_unit_steps(e: Expr) -> Expr:
    """Put 1 for step(g) in each term with this factor: step·F(step) = step·F(1).

    Arguments of functions there that are affine in g count only where g > 0: they become
    c + λ·positive(g), which is sharper where the sign of g is not known.
    """
    for s in sorted((a for a in e.all_atoms if a.kind == STEP), key=lambda a: a.order):
        with_s = {m: c for m, c in e.terms.items() if any(a is s for a, _ in m)}
        without = {m: c for m, c in e.terms.items() if m not in with_s}
        inside = _where_positive(substituted(Expr(with_s), {s: expr(1)}), s.inner)
        e = Expr(without) + inside * only(s)
    return e


def _where_positive(e: Expr, g: Expr) -> Expr:
    def change(a: Atom, p: int) -> Expr:
        if a.kind in PLAIN:
            return only(a) ** p
        new, affine = _where_positive(a.inner, g), _affine_in(a.inner, g)
        if affine is not None and affine[0] > 0:
            new = only(atom(POSITIVE, g)).scaled(affine[0]) + affine[1]
        return same_function(a, new) ** p

    return mapped(e, change)


def _affine_in(x: Expr, g: Expr) -> tuple[Fraction, Fraction] | None:
    """Return λ and c of x = λg + c; None if it is no such sum, or a number."""
    m = next((m for m in g.terms if m), None)
    if m is None or m not in x.terms:
        return None
    factor = x.terms[m] / g.terms[m]
    constant = (x - g.scaled(factor)).constant
    return None if constant is None else (factor, constant)


def with_outlined_steps(e: Expr) -> Expr:
    """Take all terms with steps of one argument g that depend on g alone together: they are F(g).

    Bounds on F over an interval of g are far sharper than those of its terms (`taylor.Outlined`).
    Steps of a force that jumps stay, as a body may be held there.
    """
    smooth = {a.inner for a in e.atoms if a.kind == STEP and a.extra != 1}
    for g in sorted(smooth, key=lambda g: g.digest):
        if variable_of(g) is not None or all(a.kind == VAR for a in g.atoms):
            continue  # a guard of one angle is sharp as it is
        outlined = dict[Monomial, Fraction]()
        inner = expr(0)
        for m, c in e.terms.items():
            if any(a.kind == STEP and _in_terms_of(a.inner, g) is not None for a, _ in m):
                in_g = _in_terms_of(Expr({m: c}), g)
                if in_g is not None:
                    outlined[m] = c
                    inner = inner + in_g
        if outlined:
            rest = Expr({m: c for m, c in e.terms.items() if m not in outlined})
            e = rest + only(atom(OF, g, inner))
    return e


def _in_terms_of(e: Expr, g: Expr) -> Expr | None:
    """Return an expression as one of g, in the variable `INNER`; None if it is none."""
    if e.constant is not None:
        return e
    affine = _affine_in(e, g)
    if affine is not None:
        return variable(INNER).scaled(affine[0]) + affine[1]
    inner = {a: None if a.kind in {VAR, OF} else _in_terms_of(a.inner, g) for a in e.atoms}
    inner_of_g = {a: x for a, x in inner.items() if x is not None}
    if len(inner_of_g) < len(inner):
        return None
    return mapped(e, lambda a, p: same_function(a, inner_of_g[a]) ** p)


def spread(e: Expr) -> Expr:
    """Multiply out sums that stand as factors, also beside negative powers."""

    def change(a: Atom, p: int) -> Expr:
        if a.kind == LET and p > 0:
            return reduce(product, [a.inner] * p)
        return Expr({((a, p),): Fraction(1)})

    return mapped(e, change, product)


class Quadratic(NamedTuple):
    """An expression as ½ x'Hx + b'x + rest, for some variables x.

    Attributes:
        H: The numbers H, symmetric.
        b: Expressions without x.
        rest: What has no x outside functions, and terms of another form.
    """

    H: list[list[Fraction]]
    b: list[Expr]
    rest: Expr


def quadratic_in(
    e: Expr, numbers: Sequence[int], constant: Iterable[str] | None = None
) -> Quadratic:
    """Take an expression apart as a quadratic function of some variables.

    Args:
        e: The expression.
        numbers: The variables x.
        constant: The kinds of atoms that may stand beside x; all by default. Terms of x with other
            factors, or of a higher degree, stay in the rest.
    """
    places = {atom(VAR, k): i for i, k in enumerate(numbers)}
    n, kinds = len(numbers), None if constant is None else frozenset(constant)
    H = [[Fraction(0)] * n for _ in range(n)]
    b, rest = [expr(0)] * n, dict[Monomial, Fraction]()
    for m, c in e.terms.items():
        powers = [(places[a], p) for a, p in m if a in places]
        others = [(a, p) for a, p in m if a not in places]
        degree = sum(p for _, p in powers) if all(p > 0 for _, p in powers) else 0
        fits = kinds is None or all(a.kind in kinds for a, _ in others)
        if degree == 1 and fits:
            k = powers[0][0]
            b[k] = b[k] + Expr({monomial(others): c})
        elif degree == 2 and not others:
            i, j = powers[0][0], powers[-1][0]
            H[i][j] += c
            H[j][i] += c
        else:
            rest[m] = c
    return Quadratic(H, b, Expr(rest))


def derivative(
    e: Expr, rates: Mapping[int, Expr], atom_rates: dict[Atom, Expr] | None = None
) -> Expr:
    """Return the rate of an expression where its variables have rates; steps have none.

    The derivative by one variable has the rate 1 of it.

    Args:
        e: The expression.
        rates: The rates of some variables; those of the others are zero.
        atom_rates: The rates of atoms that were computed from these rates; others are put into it.
    """
    atom_rates, parts = {} if atom_rates is None else atom_rates, list[Expr]()
    for m, c in e.terms.items():
        for a, p in m:
            if a.kind == STEP or a.variables.isdisjoint(rates):
                continue
            if a not in atom_rates:
                atom_rates[a] = _rate(a, rates, atom_rates)
            rest = Expr({monomial((b, n - (b is a)) for b, n in m): c * p})
            parts.append(rest * atom_rates[a])
    return summed(parts)


def _rate(a: Atom, rates: Mapping[int, Expr], atom_rates: dict[Atom, Expr]) -> Expr:
    if a.kind == VAR:
        assert isinstance(a.argument, int)
        return rates[a.argument]
    return slope(a) * derivative(a.inner, rates, atom_rates)


def slope(a: Atom) -> Expr:
    """Return the derivative of a function by its argument."""
    x = a.inner
    slopes: dict[str, Callable[[], Expr]] = {
        LET: lambda: expr(1),
        SIN: x.cos,
        COS: lambda: -x.sin(),
        "sqrt": lambda: 1 / (2 * only(a)),
        "exp": lambda: only(a),
        "log": lambda: 1 / x,
        "atan": lambda: 1 / (1 + x * x),
    }
    return slopes[a.kind]()
