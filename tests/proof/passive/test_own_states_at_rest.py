"""Protects what is shown of own states of users: that they move down the energy, or nothing."""

import numpy as np
import pytest

from rbstab.mechanics import numbers
from rbstab.proof.exact.expr import expr, variable
from rbstab.proof.exact.rewriting import derivative
from rbstab.proof.passive.passive import moves_down

K = np.array([[3.0, 1.0, 0.0], [1.0, 2.0, 0.5], [0.0, 0.5, 4.0]])
Q = np.array([variable(k) for k in range(9)], dtype=object)
"""Θ, X and D."""

OWN_STATES = range(6, 9)


def relaxes(energy, rates):
    """Return whether dD/dt = rates moves down an energy; both are functions of Θ, X and D."""
    parts = Q[:3], Q[3:6], Q[6:]
    return moves_down(expr(energy(*parts)), OWN_STATES, [expr(rate) for rate in rates(*parts)])


def stored(Theta, X, D):
    """½ (e - D)'K(e - D) + D'D with e = X + sin Θ."""
    e = X + np.array([numbers.sin(angle) for angle in Theta])
    return 0.5 * ((e - D) @ K @ (e - D)) + D @ D


def root(slopes, Theta):
    return slopes / numbers.sqrt(1.0 + slopes @ slopes)


def eyring(slopes, Theta):
    return np.array([-numbers.sinh(-2.0 * slope) * numbers.exp(Theta[1]) for slope in slopes])


def turned(slopes, Theta):
    return slopes * (2.0 + numbers.cos(Theta[0]))


def stiffening(Theta, X, D):
    """Springs whose energies are no quadratics."""
    e = X[0] + numbers.sin(Theta[1]) - D[0]
    pairs = numbers.cosh(D[1] - D[2]) + numbers.exp(0.5 * D[2])
    return numbers.exp(e) - e + 0.5 * D[0] * D[0] + pairs - D[2] + D[1] ** 4


ENERGIES = {"quadratic": stored, "stiffening": stiffening}
SKEW = np.array([[0, 5.0, 0], [-5.0, 0, 1.0], [0, -1.0, 0]])
SINGULAR = np.array([[1.0, 2.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
"""M + M' has an eigenvalue 0."""

RATES = {
    "with a skew part": (lambda s, *_: (np.eye(3) + SKEW) @ s, True),
    "nearly singular": (lambda s, *_: (SINGULAR * [[1, 0.999, 1], [1, 1, 1], [1, 1, 1]]) @ s, True),
    "a zero over what varies": (lambda s, Theta, *_: s + 0.0 / numbers.exp(Theta[0]), True),
    "a cube": (lambda s, *_: s * s * s, True),
    "a root": (lambda s, Theta, *_: root(s, Theta), True),
    "Eyring": (lambda s, Theta, *_: eyring(s, Theta), True),
    "upward by a root": (lambda s, Theta, *_: -root(s, Theta), False),
    "zero elsewhere too": (lambda s, *q: s * q[2] * q[2], False),
    "one is kept": (lambda s, *_: np.diag([1.0, 0.0, 1.0]) @ s, False),
    "singular": (lambda s, *_: SINGULAR @ s, False),
    "of another energy": (lambda s, *q: s + 0.001 * q[1], False),
    "of a sign that is not seen": (lambda s, Theta, *_: turned(s, Theta), False),
    # With different factors, M s may go up if M is not diagonal.
    "signs with a matrix": (lambda s, *q: ((np.eye(3) + SKEW) @ s) / (1.0 + q[2] ** 2), False),
}


@pytest.mark.parametrize("energy", ENERGIES)
@pytest.mark.parametrize("name", RATES)
def test_own_states_that_move_down_their_energy(name, energy):
    rates, expected = RATES[name]
    W = ENERGIES[energy]
    slope = np.array([derivative(expr(W(Q[:3], Q[3:6], Q[6:])), {k: expr(1)}) for k in OWN_STATES])
    assert relaxes(W, lambda *q: -rates(slope, *q)) is expected


def test_an_energy_that_does_not_depend_on_the_own_state():
    assert not relaxes(lambda _, X, __: X @ X, lambda _, __, D: -D)
