"""Eq. 26 and 28: the work of the contact force, and the energy balance with it."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from support.differences import along, derivative, relative_error
from support.elements import random_spd
from support.pose import turned
from support.reading import gain, kinetic_energy, read, total_energy
from support.systems import random_state, random_system

from rbstab.elements.visco_elastic import ViscoElasticConnector
from rbstab.systems.coordinates import ContactCoordinates, ManifoldCoordinates, ReducedCoordinates
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
def test_eq_26_power_is_the_paper_s_product(rng, variant):
    system = random_system(rng, variant)
    y = random_state(rng, system)
    reading, Lambda_ = read(system, y), system.observe(y).contact_force
    R = system.body.contact_point
    # The power of Λ by the velocity of C, and as a force and a moment at the centre.
    at_C = derivative(lambda t: turned(reading.A, reading.Omega, t) @ R + reading.V * t) @ Lambda_
    at_centre = np.cross(R, reading.A.T @ Lambda_) @ reading.Omega + reading.V @ Lambda_
    assert system.audited_rates(y)[-1] == pytest.approx(at_C, rel=1e-10)
    assert system.audited_rates(y)[-1] == pytest.approx(at_centre, rel=1e-13)


def test_eq_26_force_that_holds_the_point_does_no_work(rng):
    system = random_system(rng, "permanent", ReducedCoordinates())
    assert system.audited_rates(random_state(rng, system))[-1] == 0


def test_eq_26_work_of_an_undamped_spring_is_what_it_gives_up(rng):
    tied = random_system(rng, "visco-elastic")
    spring = ViscoElasticConnector(random_spd(rng, 2000), np.zeros((3, 3)))
    system = System(tied.body, (*tied.elements[:3], spring), tied.coordinates, tied.anchor)
    y = random_state(rng, system)
    run = solve_ivp(
        lambda _, y: system.audited_rates(y),
        (0, 0.01),
        np.concatenate([y, np.zeros(2)]),
        method="DOP853",
        rtol=1e-12,
        atol=1e-12,
    )
    start, end = (read(system, state[:-2]).E for state in (run.y[:, 0], run.y[:, -1]))
    given_up = 0.5 * start @ spring.K_c @ start - 0.5 * end @ spring.K_c @ end
    scale = 0.5 * start @ spring.K_c @ start
    assert relative_error(run.y[-1, -1], given_up, scale) < 1e-12


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
