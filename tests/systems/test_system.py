"""A system adds up its elements: states, energies, dissipation, forces, in the order given."""

from dataclasses import replace

import numpy as np
import pytest
from support.differences import relative_error
from support.elements import random_spd
from support.reading import read, stored_energy
from support.systems import VARIANTS, random_state, random_system

from rbstab.elements.element import NO_STATE
from rbstab.elements.embedded import EmbeddedConnector
from rbstab.elements.inputs.loads import ForceInput
from rbstab.elements.inputs.signals import Constant
from rbstab.elements.visco_elastic import ViscoElasticConnector
from rbstab.mechanics.algebra import ZERO
from rbstab.systems.coordinates import (
    CentreCoordinates,
    ContactCoordinates,
    ManifoldCoordinates,
    ReducedCoordinates,
)
from rbstab.systems.system import AUDIT_SIZE, System

TIED = (CentreCoordinates(), ContactCoordinates())
HELD = (ReducedCoordinates(), ManifoldCoordinates(), ManifoldCoordinates(5.0))
EVERY = [
    (variant, coordinates)
    for variant in VARIANTS
    for coordinates in (HELD if variant == "permanent" else TIED)
]


@pytest.fixture(params=EVERY, ids=lambda every: f"{every[0]} {every[1].name}")
def system(request, rng):
    return random_system(rng, *request.param)


def with_elements(system, *elements):
    return System(system.body, elements, system.coordinates, system.anchor)


def test_audited_rates_are_the_rates_and_the_audit(rng, system):
    y = random_state(rng, system)
    audited = system.audited_rates(y)
    assert audited.shape == (system.size + AUDIT_SIZE,)
    np.testing.assert_array_equal(audited[: system.size], system.rates(y))
    observed = system.observe(y)
    assert audited[-2] == pytest.approx(-observed.dissipation.sum(), rel=1e-13)
    assert audited[-1] == pytest.approx(observed.motion.F @ observed.contact_force, rel=1e-13)


def test_audit_of_a_system_with_inputs_has_what_they_supply(rng):
    system = random_system(rng, "visco_elastic", CentreCoordinates())
    d, amplitude = np.array([0.6, 0.0, 0.8]), 3.0
    push = ForceInput(name="push", direction=d, amplitude=amplitude, signal=Constant(), point=ZERO)
    driven = with_elements(system, *system.elements, push)
    y = random_state(rng, system)
    observed = driven.observe(y)
    supplied, lyapunov_rate, work = driven.audited_rates(y)[driven.size :]
    # The force acts at the centre of gravity, so it works with V alone.
    assert supplied == pytest.approx(amplitude * d @ observed.motion.V, rel=1e-13)
    assert lyapunov_rate == pytest.approx(supplied - observed.dissipation.sum(), rel=1e-13)
    assert work == pytest.approx(observed.motion.F @ observed.contact_force, rel=1e-13)


def test_observation_is_the_motion_by_geometry(rng, system):
    y = random_state(rng, system)
    observed, expected = system.observe(y), read(system, y)
    for name in ("Theta", "Omega", "X", "V", "A", "E", "F"):
        by_geometry = getattr(expected, name)
        # In reduced coordinates F is zero, and no scale.
        scale = max(np.abs(by_geometry).max(), 1.0)
        assert relative_error(getattr(observed.motion, name), by_geometry, scale) < 1e-11
    np.testing.assert_array_equal(observed.own_states, expected.D)


def test_potential_energy_is_all_that_is_stored(rng, system):
    y = random_state(rng, system)
    expected = stored_energy(system, read(system, y))
    assert system.potential_energy(y) == pytest.approx(expected, rel=1e-13)
    assert system.observe(y).energy[1:].sum() == pytest.approx(expected, rel=1e-13)


def test_each_element_reads_and_moves_its_own_states(rng):
    tied = random_system(rng, "free")
    first, second = (
        EmbeddedConnector(*(random_spd(rng, scale) for scale in (2000, 90, 1500, 150)))
        for _ in range(2)
    )
    plain = ViscoElasticConnector(random_spd(rng, 900), random_spd(rng, 40))
    system = with_elements(tied, first, plain, second)
    y = random_state(rng, system)
    assert system.size == 18
    observed, motion = system.observe(y), system.motion(y)
    np.testing.assert_array_equal(system.rates(y)[12:15], first.rates(motion, y[12:15]))
    np.testing.assert_array_equal(system.rates(y)[15:18], second.rates(motion, y[15:18]))
    np.testing.assert_array_equal(system.audited_rates(y)[12:18], system.rates(y)[12:18])
    stored = [first.stored(motion, y[12:15]), plain.stored(motion, NO_STATE)]
    np.testing.assert_array_equal(observed.energy[1:3], stored)
    assert observed.energy[3] == second.stored(motion, y[15:18])
    pull = sum(wrench.contact_force for wrench in observed.wrenches)
    assert relative_error(observed.contact_force, pull) < 1e-15
    np.testing.assert_array_equal(observed.own_states, y[12:18])


def test_a_body_without_elements_moves_by_itself(rng):
    system = replace(random_system(rng, "free"), elements=())
    y = random_state(rng, system)
    Omega, J = y[3:6], system.body.inertia
    assert system.rates(y)[3:6] == pytest.approx(np.linalg.solve(J, -np.cross(Omega, J @ Omega)))
    assert system.audited_rates(y)[-2:].tolist() == [0.0, 0.0]
