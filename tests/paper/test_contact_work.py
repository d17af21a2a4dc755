"""Eq. 26 and 28: the work of the contact force, and the energy balance with it."""

import pytest
from support.differences import along, relative_error
from support.reading import gain, kinetic_energy, read, total_energy
from support.systems import random_state, random_system

from rbstab.systems.coordinates import ContactCoordinates, ManifoldCoordinates
from rbstab.systems.system import System

TIED = ("visco-elastic", "embedded")


def without_connector(system):
    """Return the system without its connector, whose energy is then not counted."""
    return System(system.body, system.elements[:3], system.coordinates, system.anchor)


@pytest.mark.parametrize("variant", TIED)
@pytest.mark.parametrize("coordinates", [None, ContactCoordinates()], ids=["Z", "W"])
def test_eq_26_power_of_the_contact_force_is_what_the_other_forces_leave(rng, variant, coordinates):
    system = random_system(rng, variant, coordinates)
    y = random_state(rng, system)
    reading, observed = read(system, y), system.observe(y)
    kinetic_rate = along(lambda y: kinetic_energy(system.body, read(system, y)), y, system.rates(y))
    others = sum(w.force @ reading.V + w.couple @ reading.Omega for w in observed.wrenches)
    power = system.audited_rates(y)[-1]
    assert relative_error(power, kinetic_rate - others, abs(others) + abs(power)) < 1e-9


@pytest.mark.parametrize("variant", TIED)
def test_eq_28_energy_less_the_work_of_the_contact_force_only_falls_by_damping(rng, variant):
    system = random_system(rng, variant)
    y = random_state(rng, system)
    energy_rate = along(lambda y: total_energy(without_connector(system), y), y, system.rates(y))
    power = system.audited_rates(y)[-1]
    V, Omega = read(system, y).V, y[3:6]
    lost = V @ gain(system, "L_t") @ V + Omega @ gain(system, "L_r") @ Omega
    assert relative_error(energy_rate - power, -lost, abs(power) + lost) < 1e-9


def test_eq_28_holds_off_the_sub_manifold_as_well(rng):
    # The contact point moves, so the force of constraint does work.
    system = random_system(rng, "permanent", ManifoldCoordinates())
    y = random_state(rng, system)
    energy_rate = along(lambda y: total_energy(system, y), y, system.rates(y))
    lyapunov_rate, power = system.audited_rates(y)[-2:]
    scale = abs(power) + abs(lyapunov_rate)
    assert abs(power) > 1e-3 * scale
    assert relative_error(energy_rate - power, lyapunov_rate, scale) < 1e-10
