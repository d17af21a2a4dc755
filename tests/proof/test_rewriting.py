"""Rewriting keeps the value at every point, and the forms that it is for."""

from fractions import Fraction

from flint import arb_series, ctx
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from support.balls import BITS, series, value
from support.expressions import RATIONAL, energies, steps, terms

from rbstab.proof.exact.atoms import INNER, LET, OF, POSITIVE, STEP, VAR
from rbstab.proof.exact.expr import atom, expr, variable
from rbstab.proof.exact.matrices import inverse_of_definite
from rbstab.proof.exact.rewriting import (
    derivative,
    quadratic_in,
    spread,
    substituted,
    with_outlined_steps,
    with_unit_steps,
)

X, Y, Z, W = (variable(k) for k in range(4))
POINTS = st.lists(st.floats(-2, 2), min_size=3, max_size=3)
HALF = Fraction(1, 2)


def same_value(left, right, point):
    """Whether both expressions have one value at a point; no step may be just there."""
    place = dict(enumerate(point))
    try:
        a, b = value(left, place), value(right, place)
    except ValueError:
        assume(False)
        raise
    return abs(float(a - b)) <= 1e-60 * (1 + abs(float(a)))


patient = settings(
    deadline=None, max_examples=25, suppress_health_check=[HealthCheck.filter_too_much]
)


@patient
@given(energies(), steps(), steps(), POINTS)
def test_known_and_outlined_steps_keep_the_value(U, first, second, point):
    total = U + first * second + first * X.cos() + second.sin() * first
    rewritten = with_unit_steps(total)
    assert same_value(total, rewritten, point)
    assert same_value(total, with_outlined_steps(rewritten), point)
    assert same_value(total, spread(total), point)


@patient
@given(energies(), energies(), POINTS)
def test_substitution_is_evaluation_in_two_steps(U, other, point):
    moved = substituted(U, {atom(VAR, 0): other})
    try:
        inner = value(other, dict(enumerate(point)))
        assume(abs(float(inner)) < 20)
        expected = value(U, {0: inner, 1: point[1], 2: point[2]})
        actual = value(moved, dict(enumerate(point)))
    except ValueError:
        return
    assert abs(float(actual - expected)) <= 1e-50 * (1 + abs(float(expected)))


@patient
@given(terms(), terms(), POINTS, POINTS)
def test_a_derivative_is_that_of_the_series_along_a_line(first, second, point, rates):
    """Not at a step, which counts as a constant."""
    U = first * second + first / (2 + second * second)
    with ctx.workprec(BITS):
        line = {k: arb_series([x, v], 2) for k, (x, v) in enumerate(zip(point, rates, strict=True))}
        slope = derivative(U, {k: expr(Fraction(v)) for k, v in enumerate(rates)})
        try:  # √x has no derivative at 0
            expected = series(U, line, 2)[1]
            difference = value(slope, dict(enumerate(point))) - expected
        except ValueError:
            assume(False)
    assert abs(float(difference)) <= 1e-50 * (1 + abs(float(expected)))


def test_in_a_term_with_a_step_its_argument_is_positive():
    """step(g) (2 + 3g)^½ g²: the root is taken of 2 + 3 positive(g), which has no pole."""
    g = X - 1
    e = with_unit_steps(g.step(2) * (2 + 3 * g).sqrt() * g**2)
    kinds = {a.kind for a in e.all_atoms}
    assert POSITIVE in kinds
    # A falling argument is left as it is: g positive would raise it.
    falling = with_unit_steps(g.step(2) * (2 - 3 * g).exp())
    assert POSITIVE not in {a.kind for a in falling.all_atoms}


def test_terms_of_one_argument_become_one_function():
    """F(ℓ) = step(ℓ - 1) (ℓ - 1)² + step(ℓ - 2) (ℓ - 2)³ of a length; jumps and guards stay."""
    length = (X * X + Y.sin() + 2).sqrt()
    g = length - 1
    U = g.step(2) * g**2 + (g - 1).step(2) * (g - 1) ** 3 + Z * Z
    e = with_outlined_steps(U)
    (outlined,) = (a for a in e.atoms if a.kind == OF)
    assert outlined.inner in (g, g - 1)
    assert isinstance(outlined.extra, type(g))
    assert outlined.extra.variables == {INNER}
    assert STEP not in {a.kind for a in e.atoms}
    for left in (g.step(1) * g, X.step(2) * X**2, (X + Y).step(2) * (X + Y) ** 2):
        assert with_outlined_steps(left + Z * Z) == left + Z * Z


def test_a_quadratic_function_is_taken_apart():
    """½ (2x² + 2xy + 3y²) + x sin z + 5y + x³ + exp(x)."""
    e = X * X + X * Y + Fraction(3, 2) * Y * Y + X * Z.sin() + 5 * Y + X**3 + X.exp()
    parts = quadratic_in(e, [0, 1])
    assert parts.H == [[2, 1], [1, 3]]
    assert parts.b == [Z.sin(), expr(5)]
    assert parts.rest == X**3 + X.exp()


def test_quotients_of_variables_are_not_quadratic():
    quotients = X**2 * Y**-1 + X**3 * Y**-1 + Y**-1
    parts = quadratic_in(X * Y + quotients, [0, 1])
    assert parts.H == [[0, 1], [1, 0]]
    assert (parts.b, parts.rest) == ([expr(0)] * 2, quotients)


@settings(deadline=None, max_examples=20)
@given(st.lists(RATIONAL, min_size=9, max_size=9))
def test_an_inverse_is_one_exactly_or_the_matrix_is_not_definite(entries):
    A = [entries[:3], entries[3:6], entries[6:]]
    for shift in (0, 1):
        G = [
            [sum(A[k][i] * A[k][j] for k in range(3)) + shift * (i == j) for j in range(3)]
            for i in range(3)
        ]
        inverse = inverse_of_definite(G)
        assert inverse is not None or shift == 0
        if inverse is None:
            continue
        for i in range(3):
            for j in range(3):
                assert sum(G[i][k] * inverse[k][j] for k in range(3)) == (i == j)
        assert inverse_of_definite([[-x for x in row] for row in G]) is None


def test_sums_beside_poles_are_multiplied_out():
    e = (1 + X.cos()) * (Y + 1).sqrt() / W.cos()
    assert LET in {a.kind for a in e.atoms}
    assert spread(e) == (Y + 1).sqrt() / W.cos() + X.cos() * (Y + 1).sqrt() / W.cos()
