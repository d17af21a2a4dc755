"""Code is made once for a structure, and never used for another one."""

from dataclasses import replace

import numpy as np
import pytest
from support.springs import Spring, with_spring
from support.systems import random_state, random_system

from rbstab.elements.visco_elastic import ViscoElasticConnector
from rbstab.integrate.straight_line import equations as module
from rbstab.integrate.straight_line.equations import audited_rates_of
from rbstab.systems.coordinates import ContactCoordinates


@pytest.fixture(autouse=True)
def _empty():
    module.forget_codes()


def codes_made():
    return module._code.cache_info().misses


def close(system, y):
    rates = audited_rates_of(system).finite_value(y)
    assert rates is not None
    np.testing.assert_allclose(rates, system.audited_rates(y), rtol=1e-9, atol=1e-9)


def test_systems_of_one_structure_share_code_but_no_numbers(rng):
    systems = [random_system(rng, "embedded") for _ in range(5)]
    y = np.concatenate([random_state(rng, systems[0]), np.zeros(2)])
    lines = [audited_rates_of(system) for system in systems]
    for system, line in zip(systems, lines, strict=True):
        np.testing.assert_allclose(line(y), system.audited_rates(y), rtol=1e-9, atol=1e-9)
    assert codes_made() == 1
    assert np.abs(lines[0](y) - lines[1](y)).max() > 1.0


def test_zeros_make_other_code(rng):
    full = random_system(rng, "visco-elastic")
    y = np.concatenate([random_state(rng, full), np.zeros(2)])
    for k in range(3):
        anchor = full.anchor.copy()
        anchor[k] = 0.0
        close(replace(full, anchor=anchor), y)
    connector = full.elements[-1]
    assert isinstance(connector, ViscoElasticConnector)
    for K_c in (np.diag(np.diag(connector.K_c)), np.zeros((3, 3)), connector.K_c):
        close(replace(full, elements=(*full.elements[:-1], replace(connector, K_c=K_c))), y)
    assert codes_made() == 6
    close(full, y)
    assert codes_made() == 6


def test_coordinates_elements_and_order_make_other_code(rng):
    system = random_system(rng, "visco-elastic")
    y = np.concatenate([random_state(rng, system), np.zeros(2)])
    g, H, N, connector = system.elements
    others = [
        system,
        replace(system, coordinates=ContactCoordinates()),
        replace(system, elements=(g, H, N)),
        replace(system, elements=(g, N, H, connector)),
    ]
    for count, other in enumerate(others, 1):
        close(other, y)
        assert codes_made() == count


def test_elements_with_other_functions_share_no_code(rng):
    """A function in a field is no parameter: it cannot be an input of the code."""
    single = with_spring(rng, lambda E: E)
    y = np.concatenate([random_state(rng, single), np.zeros(2)])
    double = replace(single, elements=(*single.elements[:-1], Spring(700.0, lambda E: 2.0 * E)))
    close(single, y)
    close(double, y)
