"""Polynomials of the entries of A as forms of quaternions, and energies in four charts.

With q = (q₀, q₁, q₂, q₃), not zero, and N = q'q: A = R(q)/N, where R has the degree 2. So a
polynomial of degree d in A is a form of degree 2d over N^d, which is divided by N as often as
possible: A'A = I cancels. Of q and all its multiples the chart k takes the one with q_k = 1. Each
rotation is in a chart with the other three between -1 and 1: that of its largest |q_k|.
"""

from collections.abc import Iterator
from fractions import Fraction
from typing import NamedTuple

from rbstab.proof.exact.atoms import LET, VAR, Atom, Monomial, monomial
from rbstab.proof.exact.expr import Expr, as_factor, atom, expr, only, same_function, variable
from rbstab.proof.exact.rewriting import substituted
from rbstab.proof.rotations.energy import ENTRIES

Q = tuple(variable(k) for k in range(4))
"""q₀ to q₃ in forms."""

N = Q[0] ** 2 + Q[1] ** 2 + Q[2] ** 2 + Q[3] ** 2

_FIRST = atom(VAR, 0)


class Form(NamedTuple):
    """numerator(q)/N^power, with a numerator that N does not divide if the power is not zero."""

    numerator: Expr
    power: int


def rotation_form(i: int, j: int) -> Expr:
    """Return R_ij(q), the numerator of A_ij, i and j from 0.

    R = (q₀² - v'v) I + 2 vv' + 2 q₀ v̌ with v = (q₁, q₂, q₃).
    """
    if i == j:
        return 2 * Q[0] ** 2 + 2 * Q[i + 1] ** 2 - N
    k = 3 - i - j
    sign = 1 if (j - i) % 3 == 2 else -1
    return 2 * Q[i + 1] * Q[j + 1] + sign * 2 * Q[0] * Q[k + 1]


_ROTATION = {ENTRIES + 3 * i + j: rotation_form(i, j) for i in range(3) for j in range(3)}


def parts(e: Expr) -> Iterator[tuple[Monomial, Form]]:
    """Yield an expression as Σ (product of other atoms) · (form of q)."""
    groups: dict[Monomial, dict[Monomial, Fraction]] = {}
    for m, c in e.terms.items():
        entries = tuple((a, p) for a, p in m if is_entry(a))
        rest = tuple((a, p) for a, p in m if not is_entry(a))
        groups.setdefault(rest, {})[entries] = c
    for rest, polynomial in groups.items():
        yield rest, form_of(polynomial)


def is_entry(a: Atom) -> bool:
    """Return whether an atom is an entry of A."""
    return a.kind == VAR and a.argument in _ROTATION


def form_of(polynomial: dict[Monomial, Fraction]) -> Form:
    """Return a polynomial of the entries of A as a form over the least power of N."""
    degrees = {m: sum(p for _, p in m) for m in polynomial}
    power = max(degrees.values(), default=0)
    total = expr(0)
    for m, c in polynomial.items():
        term = expr(c)
        for a, p in m:
            assert isinstance(a.argument, int)
            for _ in range(p):
                term = term * _ROTATION[a.argument]
        for _ in range(power - degrees[m]):
            term = term * N
        total = total + term
    while power:
        quotient = divided(total)
        if quotient is None:
            break
        total, power = quotient, power - 1
    return Form(total, power)


def divided(e: Expr) -> Expr | None:
    """Return a polynomial of q divided by N; None if N does not divide it."""
    rest, quotient = e, expr(0)
    while rest.terms:
        m = max(rest.terms, key=lambda m: dict(m).get(_FIRST, 0))
        powers = dict(m)
        if powers.get(_FIRST, 0) < 2:
            return None
        powers[_FIRST] -= 2
        part = Expr({monomial(powers.items()): rest.terms[m]})
        quotient, rest = quotient + part, rest - part * N
    return quotient


def in_chart(e: Expr, k: int) -> Expr:
    """Return a function of A and other variables in the chart q_k = 1.

    The other three q are the variables 0, 1 and 2, in their order.
    """
    others = iter(range(3))
    places = {atom(VAR, i): expr(1) if i == k else variable(next(others)) for i in range(4)}
    norm = only(atom(LET, substituted(N, places)))
    total = expr(0)
    for rest, form in parts(e):
        term = substituted(form.numerator, places)
        if form.power:
            term = as_factor(term) * norm**-form.power if term.terms else term
        for a, p in rest:
            base = only(a) if a.kind == VAR else same_function(a, in_chart(a.inner, k))
            term = term * base**p
        total = total + term
    return total
