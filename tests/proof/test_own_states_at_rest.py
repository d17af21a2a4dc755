"""Protects what is shown of own states of users: that they move down the energy, or nothing."""

import numpy as np
import pytest
from rbstab.analysis.proof.traced.relaxing import relaxes

from rbstab.analysis.proof.formulas.polynomials import is_quadratic, normal, polynomial_of
from rbstab.analysis.proof.formulas.program import LENGTH, THETA, program_of
from rbstab.analysis.proof.polynomial import Ring
from rbstab.integrate.straight_line.number import Trace
from rbstab.mechanics import numbers

K = np.array([[3.0, 1.0, 0.0], [1.0, 2.0, 0.5], [0.0, 0.5, 4.0]])
RING = Ring(3, 6)
OWN = range(3, 6)


def program(formula):
    """Return a formula of Θ and x = [X, D]."""
    trace, inputs = Trace(), {}
    variables = []
    for kind, count in ((THETA, 3), (LENGTH, 6)):
        for place in range(count):
            number = trace.input(varies=True)
            inputs[number.index] = (kind, place)
            variables.append(number)
    q = np.array(variables, dtype=object)
    result = formula(q[:3], q[3:6], q[6:])
    return program_of(trace, trace.index_of(result), inputs)


def energy(formula):
    found = polynomial_of(program(formula), RING)
    assert found is not None
    return found


def stored(Theta, X, D):
    """½ (e - D)'K(e - D) + D'D with e = X + sin Θ."""
    e = X + np.array([numbers.sin_of(angle) for angle in Theta])
    return 0.5 * ((e - D) @ K @ (e - D)) + D @ D


def slope(Theta, X, D):
    """∂/∂D of it."""
    e = X + np.array([numbers.sin_of(angle) for angle in Theta])
    return -K @ (e - D) + 2.0 * D


def found_with(M, of=slope, added=0.0):
    rates = [program(lambda *q, i=i: -(M @ of(*q))[i] + added) for i in range(3)]
    return relaxes(program(stored), OWN, rates)


MOVES = {
    "diagonal": np.diag([0.5, 1.0, 2.0]),
    "symmetric": K,
    "with a skew part": np.eye(3) + np.array([[0, 5.0, 0], [-5.0, 0, 1.0], [0, -1.0, 0]]),
}

DOES_NOT = {
    "upward": -np.eye(3),
    "indefinite": np.diag([1.0, -1.0, 1.0]),
    "one is kept": np.diag([1.0, 0.0, 1.0]),
}


@pytest.mark.parametrize("name", MOVES)
def test_own_states_that_move_down(name):
    assert found_with(MOVES[name])


@pytest.mark.parametrize("name", DOES_NOT)
def test_own_states_that_do_not(name):
    assert not found_with(DOES_NOT[name])


def test_rates_of_another_energy():
    def other(Theta, X, D):
        return slope(Theta, X, D) + 0.001 * X

    assert not found_with(np.eye(3), of=other)
    assert not found_with(np.eye(3), added=0.001)


def cubic(found, Theta):
    return found * found * found


def turned(found, Theta):
    return found * (2.0 + numbers.cos_of(Theta[0]))


def root(found, Theta):
    return found / numbers.sqrt_of(1.0 + found @ found)


def power_law(found, Theta):
    return np.array([one**3 / 7.0 for one in found])


def eyring(found, Theta):
    return np.array([-numbers.sinh_of(-2.0 * one) * numbers.exp_of(Theta[1]) for one in found])


SIGN_UNKNOWN, SIGN_KNOWN = (cubic, turned), (root, power_law, eyring)


def changed(change, of=slope):
    """Return rates of which each entry is a function of the slope."""

    def found(Theta, X, D):
        return change(of(Theta, X, D), Theta)

    return found


def test_rates_whose_signs_are_not_seen():
    for one in SIGN_UNKNOWN:
        assert not found_with(np.eye(3), of=changed(one))


def test_rates_with_the_signs_of_the_slopes():
    for one in SIGN_KNOWN:
        assert found_with(np.eye(3), of=changed(one))
        assert not found_with(-np.eye(3), of=changed(one))


def test_signs_of_single_slopes_do_not_suffice_for_a_matrix():
    """-diag(s) M ∂W/∂D may go up if M is not diagonal."""

    def slower(Theta, X, D):
        return MOVES["with a skew part"] @ slope(Theta, X, D) / (1.0 + D * D)

    assert not found_with(np.eye(3), of=slower)


def test_an_energy_that_does_not_depend_on_the_own_state():
    rates = [program(lambda _, __, D, i=i: -D[i]) for i in range(3)]
    assert not relaxes(program(lambda _, X, __: X @ X), OWN, rates)


def stiffening(Theta, X, D):
    """Springs whose energies are no quadratics."""
    e = X[0] + numbers.sin_of(Theta[1]) - D[0]
    pairs = numbers.cosh_of(D[1] - D[2]) + numbers.exp_of(0.5 * D[2])
    return numbers.exp_of(e) - e + 0.5 * D[0] * D[0] + pairs - D[2] + D[1] ** 4


def slope_of_stiffening(Theta, X, D):
    e = X[0] + numbers.sin_of(Theta[1]) - D[0]
    difference = numbers.sinh_of(D[1] - D[2])
    return np.array(
        [
            1.0 - numbers.exp_of(e) + D[0],
            difference + 4.0 * D[1] ** 3,
            0.5 * numbers.exp_of(0.5 * D[2]) - difference - 1.0,
        ]
    )


def relaxes_with(M, of=slope_of_stiffening, added=0.0):
    rates = [program(lambda *q, i=i: -(M @ of(*q))[i] + added) for i in range(3)]
    return relaxes(program(stiffening), OWN, rates)


@pytest.mark.parametrize("name", MOVES)
def test_energies_that_are_no_quadratics(name):
    assert relaxes_with(MOVES[name])


@pytest.mark.parametrize("name", DOES_NOT)
def test_energies_that_are_no_quadratics_and_other_matrices(name):
    assert not relaxes_with(DOES_NOT[name])


def test_energies_that_are_no_quadratics_and_other_rates():
    def slower(Theta, X, D):
        return slope_of_stiffening(Theta, X, D) / (1.0 + D[0] * D[0])

    def other(Theta, X, D):
        return slope_of_stiffening(Theta, X, D) + 0.001 * X

    for one in (other, slope, *(changed(one, slope_of_stiffening) for one in SIGN_UNKNOWN)):
        assert not relaxes_with(np.eye(3), of=one)
    for one in (slower, *(changed(one, slope_of_stiffening) for one in SIGN_KNOWN)):
        assert relaxes_with(np.eye(3), of=one)
        assert not relaxes_with(-np.eye(3), of=one)
    assert not relaxes_with(np.eye(3), added=1e-6)


def test_a_nearly_singular_matrix_is_not_taken_for_a_definite_one():
    assert relaxes_with(np.diag([1.0, 1e-6, 1.0]))
    both = np.array([[1.0, 2.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    assert not relaxes_with(both)  # M + M' is singular
    assert relaxes_with(both * [[1, 0.999, 1], [1, 1, 1], [1, 1, 1]])


def test_a_zero_over_what_varies_is_zero():
    """As in the rate of a line at rest."""
    rates = [
        program(lambda *q, i=i: -slope(*q)[i] + 0.0 / numbers.exp_of(q[0][0])) for i in range(3)
    ]
    assert relaxes(program(stored), OWN, rates)


def test_squares_of_sines_cancel():
    def turning(Theta, X, D):
        sine, cosine = numbers.sin_of(Theta[0]), numbers.cos_of(Theta[0])
        u, w = cosine * X[0] - sine * X[1], sine * X[0] + cosine * X[1]
        return u * u + w * w + D @ D

    W = energy(turning)
    assert is_quadratic(W)
    assert normal(W - energy(lambda _, X, D: X[0] * X[0] + X[1] * X[1] + D @ D)).is_zero
    assert not is_quadratic(energy(lambda Theta, X, _: numbers.sin_of(Theta[0]) * X[0] * X[0]))
    assert not is_quadratic(energy(lambda _, X, __: X[0] * X[1] * X[2]))
    assert is_quadratic(energy(lambda Theta, X, _: numbers.sin_of(Theta[0]) * X[0] + Theta[1]))


def test_many_own_states():
    """More than the bounds of a least energy have; quadratic ones are in proofs all the same."""
    size = 12
    trace, inputs = Trace(), {}
    numbers_ = [trace.input(varies=True) for _ in range(size)]
    for place, number in enumerate(numbers_):
        inputs[number.index] = (LENGTH, place)
    squares = sum(one * one for one in numbers_)
    W = program_of(trace, trace.index_of(squares), inputs)
    rates = [program_of(trace, trace.index_of(-3.0 * one), inputs) for one in numbers_]
    assert relaxes(W, range(size), rates)
    assert not relaxes(W, range(size), [*rates[1:], rates[0]])
