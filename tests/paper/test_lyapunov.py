"""Eq. 29 to 34, 37, 42, 43, 45 and 46: the Lyapunov functions of all variants and their rates."""

from dataclasses import replace

import numpy as np
import pytest
from support.differences import along, derivative, relative_error
from support.particles import inertia_about
from support.pose import attitude, turned
from support.reading import gain, read, total_energy
from support.systems import random_state, random_system

from rbstab.analysis.rest_state import nearest_rest_state
from rbstab.elements.gravity import Gravity
from rbstab.mechanics.derivatives import jacobian
from rbstab.systems.coordinates import (
    CentreCoordinates,
    ContactCoordinates,
    ManifoldCoordinates,
    ReducedCoordinates,
)

EVERY = [
    *(
        (variant, coordinates)
        for variant in ("free", "visco-elastic", "embedded")
        for coordinates in (CentreCoordinates(), ContactCoordinates())
    ),
    ("permanent", ReducedCoordinates()),
]


def lost(system, y):
    """Return the power that the dampers take, of eq. 29, 37, 43 and 46."""
    reading = read(system, y)
    V, Omega, E, F, D = reading.V, reading.Omega, reading.E, reading.F, reading.D
    total = V @ gain(system, "L_t") @ V + Omega @ gain(system, "L_r") @ Omega
    if system.parts[-1] == "connector":
        total += F @ gain(system, "L_c") @ F
    if len(D):
        # L_d Ḋ is the pull of the two springs on the node.
        pull = gain(system, "K_c") @ (E - D) - gain(system, "K_d") @ D
        total += pull @ np.linalg.solve(gain(system, "L_d"), pull)
    return total


@pytest.mark.parametrize("weight", [0.0, 1.0], ids=["without gravity", "with gravity"])
@pytest.mark.parametrize("case", EVERY, ids=lambda case: f"{case[0]} {case[1].name}")
def test_eq_29_37_43_46_energy_counts_every_spring_and_falls_by_every_damper(rng, case, weight):
    system = random_system(rng, *case)
    gravity = Gravity(weight * gain(system, "weight"))
    system = replace(system, elements=(gravity, *system.elements[1:]))
    y = random_state(rng, system)
    assert system.observe(y).energy.sum() == pytest.approx(total_energy(system, y), rel=1e-11)
    audited = system.audited_rates(y)
    rate, flow = audited[-2], audited[:-2]
    # `lost` finds V or F by differences.
    assert rate == pytest.approx(-lost(system, y), rel=1e-10)
    assert rate == pytest.approx(-system.observe(y).dissipation.sum(), rel=1e-13)
    # In ∇v·f large powers cancel, so the largest is the scale of the error.
    gradient = jacobian(lambda y: system.observe(y).energy.sum(), y)
    largest = np.abs(gradient * flow).max()
    assert relative_error(gradient @ flow, rate, largest) < 1e-14
    by_differences = along(lambda y: total_energy(system, y), y, flow)
    assert relative_error(by_differences, rate, largest) < 1e-10
    still = np.where(np.arange(len(y)) // 3 % 2, 0.0, y)
    if case[0] in {"free", "permanent"}:
        assert system.audited_rates(still)[-2] == 0


def test_eq_42_not_eq_41_is_the_lyapunov_function(rng):
    # Case 2 refers to eq. 41, but the connector's energy alone rises while C moves outward.
    system = random_system(rng, "visco-elastic", ContactCoordinates())
    y = random_state(rng, system)
    y[9:12] = y[6:9]
    flow = system.rates(y)
    assert along(lambda y: system.observe(y).energy[-1], y, flow) > 0
    assert along(lambda y: system.observe(y).energy.sum(), y, flow) < 0


@pytest.mark.parametrize("coordinates", [CentreCoordinates(), ContactCoordinates()])
def test_eq_30_constant_h_is_the_energy_that_gravity_releases(rng, coordinates):
    system = random_system(rng, "free", coordinates)
    K_t, G = gain(system, "K_t"), gain(system, "weight")
    rest = nearest_rest_state(system)
    assert rest.rests_in_range
    assert rest.energy == pytest.approx(-0.5 * G @ np.linalg.solve(K_t, G), rel=1e-12)
    assert relative_error(rest.motion.X, np.linalg.solve(K_t, G)) < 1e-10
    np.testing.assert_allclose(rest.motion.Theta, 0, atol=1e-10)
    at_rest = system.start(rest.motion, rest.element_states)
    assert system.observe(at_rest).energy.sum() == pytest.approx(rest.energy, rel=1e-12)
    assert system.observe(random_state(rng, system)).energy.sum() > rest.energy


@pytest.fixture
def held(rng):
    """A held body with its anchor where the free body would rest, X_a = X_e, and its state."""
    system = random_system(rng, "permanent", ReducedCoordinates())
    X_e = np.linalg.solve(gain(system, "K_t"), gain(system, "weight"))
    return replace(system, anchor=X_e), random_state(rng, system)


def velocity_of_centre(system, y):
    """Return the velocity of the centre, which is at -R from C."""
    A = attitude(y[0:3])
    return -derivative(lambda t: turned(A, y[3:6], t) @ system.body.contact_point)


def test_eq_32_and_33_projected_controls(held):
    system, y = held
    A, R = attitude(y[0:3]), system.body.contact_point
    X, V = R + system.anchor - A @ R, velocity_of_centre(system, y)
    motion = system.motion(y)
    assert relative_error(motion.X, X) < 1e-14
    assert relative_error(motion.V, V) < 1e-12
    wrenches = dict(zip(system.parts[1:], system.observe(y).wrenches, strict=True))
    H = -gain(system, "K_t") @ X - gain(system, "L_t") @ V
    assert relative_error(wrenches["translational stabilizer"].force, H) < 1e-12
    # N is checked by its power, because it does not depend on the constraint.
    N, K_r = wrenches["rotational stabilizer"].couple, gain(system, "K_r")
    power = -system.rates(y)[0:3] @ K_r @ y[0:3] - y[3:6] @ gain(system, "L_r") @ y[3:6]
    assert N @ y[3:6] == pytest.approx(power, rel=1e-13)


def test_eq_34_projected_lyapunov_function(held):
    system, y = held
    rest = nearest_rest_state(system)
    assert rest.rests_in_range
    np.testing.assert_array_equal(rest.motion.Theta, 0)
    R = system.body.contact_point
    offset = R - attitude(y[0:3]) @ R
    expected = 0.5 * offset @ gain(system, "K_t") @ offset
    expected += 0.5 * y[3:6] @ inertia_about(system.body, R) @ y[3:6]
    expected += 0.5 * y[0:3] @ gain(system, "K_r") @ y[0:3]
    value = system.observe(y).energy.sum() - rest.energy
    assert value == pytest.approx(expected, rel=1e-13)


def test_eq_37_rate_with_its_second_term_as_printed(held):
    # The paper prints a plus, and still it is a loss, because Ř' = -Ř.
    system, y = held
    A, R, Omega = attitude(y[0:3]), system.body.contact_point, y[3:6]
    lever = np.cross(R, np.eye(3)).T
    printed = Omega @ lever @ A.T @ gain(system, "L_t") @ A @ lever @ Omega
    assert printed < 0
    expected = -Omega @ gain(system, "L_r") @ Omega + printed
    reading = read(system, y)
    Z = np.concatenate([y, reading.X, reading.V])
    twelve = replace(system, coordinates=ManifoldCoordinates())
    for coordinates, state in ((system, y), (twelve, Z)):
        assert coordinates.audited_rates(state)[-2] == pytest.approx(expected, rel=1e-12)
