"""A system adds up its elements, in any coordinates; its parameters are found by their names."""

from dataclasses import replace

import numpy as np
import pytest
from support.differences import relative_error
from support.path import held_path, random_path
from support.reading import read
from support.systems import VARIANTS, random_body, random_state, random_system

from rbstab.elements.inputs.loads import ForceInput
from rbstab.elements.inputs.signals import Constant
from rbstab.mechanics.algebra import ZERO
from rbstab.mechanics.motion import Wrench, motion_from_centre
from rbstab.systems.coordinates import (
    CentreCoordinates,
    ContactCoordinates,
    ManifoldCoordinates,
    ReducedCoordinates,
)
from rbstab.systems.parameters import map_parameters, parameters, structure
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


@pytest.mark.parametrize("coordinates", [*TIED, *HELD], ids=lambda c: c.name)
def test_coordinates_of_a_motion_stand_for_that_motion(rng, coordinates):
    body, anchor = random_body(rng), rng.normal(size=3)
    path = held_path(rng, body, anchor) if coordinates.holds_contact else random_path(rng, body)
    motion = motion_from_centre(body, anchor, path.Z())
    y = coordinates.from_motion(motion)
    again = coordinates.motion(body, anchor, y)
    assert y.shape == (coordinates.size,)
    for name in motion._fields:
        # On a held path F is zero up to 1e-12, the error of its differences.
        assert relative_error(getattr(again, name), getattr(motion, name), 10.0) < 1e-13


@pytest.mark.parametrize("coordinates", TIED, ids=lambda c: c.name)
def test_contact_force_of_a_free_body_is_what_the_elements_exert(rng, coordinates):
    system = random_system(rng, "free", coordinates)
    force, couple, contact_force = rng.normal(size=(3, 3))
    wrench = Wrench(force, couple, contact_force)
    motion = system.motion(rng.normal(size=12))
    _, Lambda_ = coordinates.dynamics(system.body, motion, wrench)
    np.testing.assert_array_equal(Lambda_, wrench.contact_force)


def test_parameters_of_another_system_give_its_equations(rng):
    system, other = (random_system(rng, "embedded", ContactCoordinates()) for _ in range(2))
    values = parameters(other)
    moved = map_parameters(system, lambda name, _: values[name])
    y = random_state(rng, system)
    np.testing.assert_array_equal(moved.audited_rates(y), other.audited_rates(y))
    assert np.abs(system.rates(y) - other.rates(y)).max() > 1


def test_every_parameter_is_in_the_equations(rng):
    # If the mapping missed a parameter, or the equations ignored it, the rates would not change.
    system = random_system(rng, "embedded")
    y = random_state(rng, system)

    def with_larger(chosen):
        return map_parameters(system, lambda name, value: value * (1.01 if name == chosen else 1))

    for chosen in parameters(system):
        changed = with_larger(chosen)
        assert np.abs(changed.rates(y) - system.rates(y)).max() > 1e-6, chosen


def test_structure_tells_elements_and_coordinates_apart(rng):
    systems = [
        random_system(rng, "free"),
        random_system(rng, "free", ContactCoordinates()),
        random_system(rng, "visco-elastic"),
        random_system(rng, "embedded"),
        random_system(rng, "permanent", ReducedCoordinates()),
        random_system(rng, "permanent", ManifoldCoordinates()),
    ]
    assert len({structure(system) for system in systems}) == len(systems)


def test_whole_numbers_are_parameters_too(rng):
    """A number left out would be compiled as a constant, and used for other systems too."""
    system = random_system(rng, "free")
    whole = replace(system, body=replace(system.body, mass=41))
    assert parameters(whole)["body.mass"] == 41.0
    assert structure(whole) == structure(system)


def test_two_elements_of_one_name_are_refused(rng):
    system = random_system(rng, "visco-elastic")
    twice = replace(system, elements=(*system.elements, system.elements[-1]))
    with pytest.raises(ValueError, match="two elements have the same name"):
        parameters(twice)
