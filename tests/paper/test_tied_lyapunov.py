"""Eq. 42, 43, 45 and 46: the Lyapunov functions of the tied bodies and their rates."""

from dataclasses import replace

import numpy as np
import pytest
from support.differences import along, relative_error
from support.reading import gain, read, total_energy
from support.systems import random_state, random_system

from rbstab.elements.gravity import Gravity
from rbstab.mechanics.derivatives import jacobian
from rbstab.systems.coordinates import ContactCoordinates

COORDINATES = pytest.mark.parametrize("coordinates", [None, ContactCoordinates()], ids=["Z", "W"])


def lost_by_stabilizers(system, reading):
    V, Omega = reading.V, reading.Omega
    return V @ gain(system, "L_t") @ V + Omega @ gain(system, "L_r") @ Omega


def lost_at_contact(system, reading):
    return reading.F @ gain(system, "L_c") @ reading.F


def lost_in_connector(system, reading):
    """Return Ḋ'L_dḊ, where L_dḊ is the pull of the two springs on the node."""
    E, D = reading.E, reading.D
    pull = gain(system, "K_c") @ (E - D) - gain(system, "K_d") @ D
    return pull @ np.linalg.solve(gain(system, "L_d"), pull)


def check_rate(system, y, closed):
    audited = system.audited_rates(y)
    rate, flow = audited[-2], audited[:-2]
    assert rate == pytest.approx(closed, rel=1e-10)
    assert rate == pytest.approx(-system.observe(y).dissipation.sum(), rel=1e-13)
    # In ∇v·f large powers cancel, so the largest is the scale of the error.
    gradient = jacobian(lambda y: system.observe(y).energy.sum(), y)
    largest = np.abs(gradient * flow).max()
    assert relative_error(gradient @ flow, rate, largest) < 1e-14
    by_differences = along(lambda y: total_energy(system, y), y, flow)
    assert relative_error(by_differences, rate, largest) < 1e-10


@COORDINATES
def test_eq_42_lyapunov_function_counts_every_spring(rng, coordinates):
    system = random_system(rng, "visco-elastic", coordinates)
    y = random_state(rng, system)
    assert system.observe(y).energy.sum() == pytest.approx(total_energy(system, y), rel=1e-11)
    assert system.parts[-1] == "connector"


@COORDINATES
def test_eq_43_rate_of_the_lyapunov_function(rng, coordinates):
    system = random_system(rng, "visco-elastic", coordinates)
    y = random_state(rng, system)
    reading = read(system, y)
    check_rate(system, y, -lost_by_stabilizers(system, reading) - lost_at_contact(system, reading))


@COORDINATES
def test_eq_45_lyapunov_function_counts_every_spring(rng, coordinates):
    system = random_system(rng, "embedded", coordinates)
    y = random_state(rng, system)
    assert system.observe(y).energy.sum() == pytest.approx(total_energy(system, y), rel=1e-11)


@COORDINATES
def test_eq_46_rate_of_the_lyapunov_function(rng, coordinates):
    system = random_system(rng, "embedded", coordinates)
    y = random_state(rng, system)
    reading = read(system, y)
    lost = lost_by_stabilizers(system, reading) + lost_at_contact(system, reading)
    check_rate(system, y, -lost - lost_in_connector(system, reading))


@pytest.mark.parametrize("variant", ["visco-elastic", "embedded"])
def test_eq_43_and_46_hold_without_gravity_as_printed(rng, variant):
    tied = random_system(rng, variant)
    system = replace(tied, elements=(Gravity(np.zeros(3)), *tied.elements[1:]))
    y = random_state(rng, system)
    check_rate(system, y, tied.audited_rates(y)[-2])


def test_eq_42_not_eq_41_is_the_lyapunov_function(rng):
    # Case 2 refers to eq. 41, but the connector's energy alone rises while C moves outward.
    system = random_system(rng, "visco-elastic", ContactCoordinates())
    y = random_state(rng, system)
    y[9:12] = y[6:9]
    flow = system.rates(y)

    def connector_energy(y):
        return system.observe(y).energy[-1]

    assert along(connector_energy, y, flow) > 0
    assert along(lambda y: system.observe(y).energy.sum(), y, flow) < 0
