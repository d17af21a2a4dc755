"""Parameters are named by their place, all reach the equations, and values keep the structure."""

from dataclasses import replace

import numpy as np
import pytest
from support.systems import random_state, random_system

from rbstab.systems.coordinates import (
    ContactCoordinates,
    ManifoldCoordinates,
    ReducedCoordinates,
)
from rbstab.systems.parameters import map_parameters, parameters, structure


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
