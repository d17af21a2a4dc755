"""Protects what is shown of own states of users: that they move down the energy, or nothing."""

import numpy as np
import pytest

from rbstab.mechanics import numbers
from rbstab.proof.exact.expr import expr, variable
from rbstab.proof.passive.passive import moves_down

K = np.array([[3.0, 1.0, 0.0], [1.0, 2.0, 0.5], [0.0, 0.5, 4.0]])
Q = np.array([variable(k) for k in range(9)], dtype=object)
"""Θ, X and D."""

OWN = range(6, 9)


def relaxes(energy, rates):
    """Return whether dD/dt = rates moves down an energy; both are functions of Θ, X and D."""
    parts = Q[:3], Q[3:6], Q[6:]
    return moves_down(expr(energy(*parts)), OWN, [expr(one) for one in rates(*parts)])


def stored(Theta, X, D):
    """½ (e - D)'K(e - D) + D'D with e = X + sin Θ."""
    e = X + np.array([numbers.sin_of(angle) for angle in Theta])
    return 0.5 * ((e - D) @ K @ (e - D)) + D @ D


def slope(Theta, X, D):
    """∂/∂D of it."""
    e = X + np.array([numbers.sin_of(angle) for angle in Theta])
    return -K @ (e - D) + 2.0 * D


def found_with(M, of=slope, added=0.0):
    return relaxes(stored, lambda *q: -(M @ of(*q)) + added)


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


SIGN_UNKNOWN, SIGN_KNOWN = (turned,), (cubic, root, power_law, eyring)


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
    assert not relaxes(lambda _, X, __: X @ X, lambda _, __, D: -D)


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
    return relaxes(stiffening, lambda *q: -(M @ of(*q)) + added)


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
    assert relaxes(stored, lambda *q: -slope(*q) + 0.0 / numbers.exp_of(q[0][0]))


def test_many_own_states():
    D = np.array([variable(20 + k) for k in range(12)], dtype=object)
    own = range(20, 32)
    assert moves_down(D @ D, own, list(-3.0 * D))
    assert not moves_down(D @ D, own, list(-3.0 * D[[*range(1, 12), 0]]))
