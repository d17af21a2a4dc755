"""Protects rest states of bodies with a stop: least energies with bounds on θ2, by SciPy."""

import numpy as np
import pytest
from scipy.optimize import minimize
from support.stops import stop
from support.switching import data, problem

from rbstab.analysis.approached_state import lyapunov_zero
from rbstab.analysis.configuration import configurations
from rbstab.analysis.linearisation import linearise
from rbstab.analysis.rest_state import nearest_rest_state, rest_state_below

INERTIA = [[1.0, 0.1, -0.2], [0.1, 1.5, 0.15], [-0.2, 0.15, 2.0]]


def system(angle, load=9.81, variant="permanent", elements=None):
    """Return a body without symmetry that its weight turns about θ2."""
    gains = {"K_t": [40.0, 50, 60], "L_t": [9.0] * 3, "K_r": [9.0, 10, 11], "L_r": [3.0] * 3}
    controller = {"variant": variant} | gains
    if variant == "visco-elastic":
        controller |= {"K_c": [900.0, 800, 700], "L_c": [9.0] * 3}
    end = {} if angle is None else {"end": stop(0.5, angle)}
    config = data(end | (elements or {}), controller=controller, gravity=[0.0, 0.0, -load])
    config["body"] |= {"inertia": INERTIA, "contact_point": [-0.8, 0.1, -0.2]}
    return problem(config).system


def least(stopped, angle):
    """Return the configuration of least energy with |θ2| <= θ_e."""
    at_rest = configurations(stopped)
    bounds = [(None, None)] * at_rest.size
    bounds[1] = (-angle, angle)
    options = {"ftol": 1e-15, "gtol": 1e-11, "maxiter": 5000}
    q = at_rest.unloaded
    for _ in range(3):
        q = minimize(lambda x: float(at_rest.energy(x)), q, bounds=bounds, options=options).x
    return q


@pytest.mark.parametrize(
    ("variant", "angle"), [("permanent", 0.1), ("visco-elastic", 0.3), ("free", 1.5)]
)
def test_least_energy_inside_the_stop(variant, angle):
    stopped = system(angle, variant=variant)
    rest = nearest_rest_state(stopped)
    assert rest.rests_in_range
    at_rest = configurations(stopped)
    q = at_rest.configuration(rest.motion, rest.element_states)
    np.testing.assert_allclose(q, least(stopped, angle), atol=3e-6)
    assert rest.energy == pytest.approx(float(at_rest.energy(q)), rel=1e-14)
    free = nearest_rest_state(system(None, variant=variant))
    if abs(free.motion.Theta[1]) < angle:
        np.testing.assert_allclose(rest.motion.Theta, free.motion.Theta, atol=1e-12)
    else:
        assert abs(q[1]) == angle
        assert rest.energy > free.energy + 1e-3


@pytest.mark.parametrize("side", [1, -1])
def test_what_is_at_rest_against_a_stop_is_approached_and_does_not_turn(side):
    """θ2 is held there: its two eigenvalues are zero, and no other motion turns it."""
    stopped = system(0.3, load=side * 12.0)
    rest = nearest_rest_state(stopped)
    assert rest.motion.Theta[1] == side * 0.3
    y = configurations(stopped).state(np.array([0.1, side * 0.3, -0.1]))
    zero = lyapunov_zero(stopped, stopped.motion(y), np.zeros(0), rest)
    assert zero.rest is rest
    assert zero.approached
    assert zero.is_lowest
    linear = linearise(stopped, rest.motion, rest.element_states)
    moving = linear.eigenvalues != 0
    assert (moving.sum(), linear.growing) == (4, 0)
    modes = linear.modes[:, moving]
    np.testing.assert_allclose(linear.matrix @ modes, linear.eigenvalues[moving] * modes, atol=1e-7)
    assert np.abs(modes[1]).max() < 1e-14


def test_descent_does_not_end_at_a_stop_that_the_load_pulls_away_from():
    """A turned body touches one side; when it has turned back, its weight pulls it to the other."""
    stopped = system(0.1)
    at_rest = configurations(stopped)
    rest = rest_state_below(at_rest, np.array([0.5576, -0.048, 2.0393]))
    assert rest is not None
    q = at_rest.configuration(rest.motion, rest.element_states)
    assert q[1] == 0.1
    np.testing.assert_allclose(q, least(stopped, 0.1), atol=3e-6)
