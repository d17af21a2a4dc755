"""Protects the rest energies of many members: they equal those of single runs or are not given."""

import numpy as np
import pytest
from support.problems import bare_system
from support.rest import inverted_pendulum
from support.systems import VARIANTS, random_system

from rbstab.analysis.rest_state import nearest_rest_state
from rbstab.integrate.heyoka.symbols import parameter_values
from rbstab.mechanics.body import Body
from rbstab.sweep.members.rest_energies import RestEnergies
from rbstab.systems.coordinates import ReducedCoordinates


@pytest.mark.parametrize("variant", VARIANTS)
def test_they_are_those_of_the_descent(variant):
    coordinates = ReducedCoordinates() if variant == "permanent" else None
    systems = [random_system(np.random.default_rng(k), variant, coordinates) for k in range(24)]
    parameters = np.array([parameter_values(system) for system in systems]).T
    energies, found = RestEnergies(systems[0]).energies(parameters)
    assert found.sum() >= 12
    for k in np.flatnonzero(found):
        expected = nearest_rest_state(systems[k])
        assert expected.found
        assert energies[k] == pytest.approx(expected.energy, rel=1e-9, abs=1e-9)


def test_an_unloaded_body_rests_at_once_and_a_broken_one_is_not_found():
    system = random_system(np.random.default_rng(0), "free")
    parameters = np.repeat(parameter_values(system)[:, None], 3, axis=1)
    names = RestEnergies(system)
    weight = names.energy.offsets["gravity.weight"]
    parameters[weight : weight + 3, 1] = 0.0
    anchor = names.energy.offsets["anchor"]
    parameters[anchor : anchor + 3, 1] = 0.0
    parameters[weight, 2] = np.nan
    energies, found = names.energies(parameters)
    assert found.tolist() == [True, True, False]
    assert energies[1] == 0.0
    assert energies[0] < 0


def test_a_place_at_rest_that_is_no_minimum_is_not_taken():
    """The gradient is zero for a body that balances upright on its contact point."""
    standing = inverted_pendulum([5.0, 5.0, 5.0], 20.0)
    parameters = parameter_values(standing)[:, None]
    _, found = RestEnergies(standing).energies(parameters)
    assert found.tolist() == [False]
    firm = inverted_pendulum([50.0, 50.0, 50.0], 20.0)
    energies, found = RestEnergies(firm).energies(parameter_values(firm)[:, None])
    assert found.tolist() == [True]
    assert energies[0] == pytest.approx(nearest_rest_state(firm).energy)


@pytest.mark.parametrize("load", [1e-9, 1e-3, 1e3])
def test_a_small_load_is_balanced_too(load):
    """A free body that stabilizers hold by k rests with the energy -G²/2k."""
    stiffness = 50.0 * np.eye(3)
    body = Body(2.0, np.eye(3), np.array([0.1, 0.2, 0.3]))
    system = bare_system(body, weight=(0.0, load, 0.0), K_t=stiffness, K_r=stiffness)
    energies, found = RestEnergies(system).energies(parameter_values(system)[:, None])
    assert found.tolist() == [True]
    assert energies[0] == pytest.approx(-(load**2) / 100.0, rel=1e-9, abs=0)
