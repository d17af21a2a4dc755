"""A body's gyroscopic couple, energy and inertias are right, and impossible inertias are found."""

import numpy as np
import pytest
from support.differences import derivative, relative_error
from support.pose import turned
from support.systems import random_body

from rbstab.mechanics.body import Body, triangle_violation


def test_gyroscopic_couple_turns_the_angular_momentum_back(rng):
    # The body carries JΩ with it; f is minus the rate of that.
    body, Omega = random_body(rng), rng.normal(size=3)
    dragged = derivative(lambda t: turned(np.eye(3), Omega, t) @ body.inertia @ Omega)
    assert relative_error(body.gyroscopic_couple(Omega), -dragged) < 1e-12


def test_kinetic_energy_of_a_rolling_wheel():
    # A hoop that rolls at speed v has the energy m v²: half in its velocity, half in its spin.
    mass, radius, speed = 3.0, 0.2, 1.7
    hoop = Body(mass, np.diag([0.5, 0.5, 1.0]) * mass * radius**2, np.zeros(3))
    spin, velocity = np.array([0, 0, speed / radius]), np.array([speed, 0, 0])
    assert hoop.kinetic_energy(spin, velocity) == pytest.approx(mass * speed**2, rel=1e-15)


def test_inertia_about_the_contact_point_of_a_rod():
    # A thin rod has m l²/12 about its middle and m l²/3 about its end.
    mass, length = 2.0, 0.6
    transverse = mass * length**2 / 12
    rod = Body(mass, np.diag([transverse, transverse, 0.0]), np.array([0, 0, length / 2]))
    expected = np.diag([4 * transverse, 4 * transverse, 0.0])
    np.testing.assert_allclose(rod.inertia_about_contact, expected, rtol=0, atol=1e-16)


@pytest.mark.parametrize("order", [(0, 1, 2), (1, 2, 0), (2, 1, 0)])
def test_triangle_violation_does_not_depend_on_the_axes(rng, order):
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    impossible = axes @ np.diag(np.array([10.0, 8.0, 1.9])[list(order)]) @ axes.T
    assert triangle_violation(impossible) == pytest.approx((10.0, 8.0, 1.9), rel=1e-13)
    possible = axes @ np.diag(np.array([10.0, 8.0, 2.1])[list(order)]) @ axes.T
    assert triangle_violation(possible) is None


def test_inertia_of_any_particles_is_possible(rng):
    places = rng.normal(size=(5, 3))
    squares = (places**2).sum() * np.eye(3)
    assert triangle_violation(squares - places.T @ places) is None
