"""Random expressions for tests of bounds, and boxes with points inside."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from rbstab.proof.exact.atoms import INNER, OF
from rbstab.proof.exact.expr import atom, expr, only, variable
from rbstab.proof.exact.rewriting import with_outlined_steps, with_unit_steps

RATIONAL = st.fractions(-3, 3, max_denominator=8)


@st.composite
def affine(draw, numbers=(0, 1, 2)):
    """Return a sum of variables with numbers, and a number."""
    factors = [draw(RATIONAL) for _ in numbers]
    assume(any(factors))
    return sum(
        (variable(k) * c for k, c in zip(numbers, factors, strict=True)), expr(draw(RATIONAL))
    )


@st.composite
def terms(draw, numbers=(0, 1, 2)):
    """Return one term: a function of an affine sum, a step, a quotient, or another product."""
    x = draw(affine(numbers))
    first, last = variable(numbers[0]), variable(numbers[-1])
    given = {
        "sin": x.sin(),
        "cos": x.cos(),
        "exp": (x * Fraction(1, 4)).exp(),
        "atan": x.atan(),
        "log": (x * x + 1).log(),
        "root": (x * x + 1 + first.sin() * Fraction(1, 2)).sqrt(),
        "quotient": (x + 1) / (1 + x.sin() * x.sin() + last**2),
        "power": x ** draw(st.integers(2, 3)),
        "let": ((x * x + 1).sqrt() - 2) ** draw(st.integers(2, 3)),
        "inside": (x.cos() * first).sin() * x,
    }
    kind = draw(st.sampled_from([*given, "step"]))
    return given[kind] if kind in given else draw(steps(x))


@st.composite
def steps(draw, x=None):
    """Return a force that jumps, or bends, or less, where an expression changes its sign."""
    g = draw(affine()) if x is None else x
    if draw(st.booleans()):
        g = (g * g + Fraction(1, 2)).sqrt() - 1
    order = draw(st.integers(1, 3))
    rest = draw(st.sampled_from([expr(1), (g + 2).sqrt(), g.exp(), 1 + variable(0).sin()]))
    return g.step(order) * g**order * rest


@st.composite
def energies(draw, numbers=(0, 1, 2)):
    """Return a sum of terms and of products, rewritten as energies are."""
    total = expr(0)
    for _ in range(draw(st.integers(1, 3))):
        term = draw(terms(numbers)) * draw(RATIONAL)
        if draw(st.booleans()):
            term = term * variable(draw(st.sampled_from(numbers))).cos()
        total = total + term
    if draw(st.booleans()):
        total = with_unit_steps(total)
        total = with_outlined_steps(total) if draw(st.booleans()) else total
    return total


@st.composite
def outlined(draw, g=None):
    """Return a function F(g) that stands in one atom, with a step of g in F."""
    y = variable(INNER)
    g = draw(affine()) if g is None else g
    shift = y - draw(RATIONAL)
    F = draw(st.sampled_from([shift.sin(), (shift * Fraction(1, 3)).exp(), shift.atan(), expr(1)]))
    order = draw(st.integers(1, 3))
    return only(atom(OF, g, shift.step(order) * shift**order * F))


@st.composite
def boxes(draw, n=3, reach=3.0):
    """Return a box and a point of it, all doubles; the point may be at a corner."""
    lo, hi, point = [], [], []
    size = 10.0 ** draw(st.integers(-6, 0))
    for _ in range(n):
        a = draw(st.floats(-reach, reach))
        b = min(a + size * draw(st.floats(0, 2)), reach + 1)
        lo.append(a)
        hi.append(b)
        point.append(min(b, max(a, a + draw(st.sampled_from([0.0, 0.25, 0.7, 1.0])) * (b - a))))
    return np.array(lo), np.array(hi), np.array(point)


def convex(theta, z, c, kind):
    """Return an expression that is convex in z, coupled to an expression of other variables."""
    x = z - theta
    return [
        c * x * x,
        (x * Fraction(1, 2)).exp() * c,
        (1 + x * x).sqrt() * c,
        x.step(2) * x**2 * c,
        x.step(3) * x**3 * c,
    ][kind]


COUNTS = [
    pytest.param(15, id="some"),
    pytest.param(150, id="many", marks=pytest.mark.heavy),
]
"""How many examples `fuzz` tries: the same few for every change, and others in heavy tests."""


def fuzz(test, *strategies, count):
    """Run a test for so many examples."""
    quiet = [HealthCheck.too_slow, HealthCheck.filter_too_much, HealthCheck.data_too_large]
    with np.errstate(all="ignore"):
        settings(
            deadline=None, max_examples=count, derandomize=count < 100, suppress_health_check=quiet
        )(given(*strategies)(test))()
