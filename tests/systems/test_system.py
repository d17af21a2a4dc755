"""A system adds up its elements: states, energies, dissipation, forces, in the order given."""

import numpy as np
import pytest
from support.differences import relative_error
from support.reading import read
from support.systems import VARIANTS, random_state, random_system

from rbstab.elements.inputs.loads import ForceInput
from rbstab.elements.inputs.signals import Constant
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
