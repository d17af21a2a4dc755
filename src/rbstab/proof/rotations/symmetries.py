"""Turns that leave the energy as it is, exactly: rest states then form families.

A turn e^{su} A e^{sv} moves q at the rate ½ (0, u)⊗q + ½ q⊗(0, v). All (u, v) along which no form
of the energy changes are the kernel of a matrix of rational numbers with six columns.
"""

from fractions import Fraction
from typing import NamedTuple

import numpy as np

from rbstab.analysis.exact import kernel
from rbstab.mechanics.numbers import Array
from rbstab.proof.exact.atoms import VAR, Monomial
from rbstab.proof.exact.expr import Expr, expr
from rbstab.proof.exact.rewriting import derivative
from rbstab.proof.rotations.forms import Q, parts

SPACE = (
    (-Q[1], Q[0], -Q[3], Q[2]),
    (-Q[2], Q[3], Q[0], -Q[1]),
    (-Q[3], -Q[2], Q[1], Q[0]),
)
"""(0, u)⊗q for the three unit vectors u."""

BODY = (
    (-Q[1], Q[0], Q[3], -Q[2]),
    (-Q[2], -Q[3], Q[0], Q[1]),
    (-Q[3], Q[2], -Q[1], Q[0]),
)
"""q⊗(0, v) for the three unit vectors v."""


class Turn(NamedTuple):
    """A turn e^{su} A e^{sv} for all s, with u about axes of space and v about axes of the body."""

    u: Array
    v: Array

    @property
    def words(self) -> str:
        """About which axes it turns the body."""
        named = [
            f"the {frame} axis {_axis(w)}"
            for frame, w in (("inertial", self.u), ("body", self.v))
            if any(w)
        ]
        return " and at once about ".join(named)


def symmetries(e: Expr) -> list[Turn]:
    """Return a basis of all turns that leave every form of an energy as it is, exactly.

    Of an energy that is a polynomial of A these are all of its symmetries; of others all (u, v)
    that are returned are symmetries, and there may be more.
    """
    columns = [dict[tuple[int, Monomial], Fraction]() for _ in range(6)]
    for number, numerator in enumerate(_numerators(e)):
        slopes = [derivative(numerator, {k: expr(1)}) for k in range(4)]
        for column, rates in zip(columns, (*SPACE, *BODY), strict=True):
            change = sum((s * r for s, r in zip(slopes, rates, strict=True)), expr(0))
            column.update({(number, m): c for m, c in change.terms.items()})
    keys = list({key for column in columns for key in column})
    rows = [[column.get(key, Fraction(0)) for column in columns] for key in keys]
    matrix = np.array(rows or [[Fraction(0)] * 6], dtype=object)
    return [Turn(w[:3], w[3:]) for w in kernel(matrix)]


def _numerators(e: Expr) -> list[Expr]:
    """Return the forms of an expression, with those inside functions."""
    numerators = []
    for rest, form in parts(e):
        numerators.append(form.numerator)
        for a, _ in rest:
            numerators += [] if a.kind == VAR else _numerators(a.inner)
    return numerators


def _axis(w: Array) -> str:
    entries = [name for name, entry in zip("xyz", w, strict=True) if entry]
    if len(entries) == 1:
        return entries[0]
    return "(" + ", ".join(f"{float(entry / max(w, key=abs)):.4g}" for entry in w) + ")"
