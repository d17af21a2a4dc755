"""An element without statements does nothing, and the known elements keep their names and sizes."""

import numpy as np
import pytest
from support.systems import random_body, random_Z

from rbstab.elements.declarations import Gain
from rbstab.elements.element import (
    NO_STATE,
    Element,
    couple_on_body,
    force_at_centre,
    force_at_contact,
)
from rbstab.elements.embedded import EmbeddedConnector
from rbstab.elements.gravity import Gravity
from rbstab.elements.registry import ELEMENTS
from rbstab.elements.rotational_stabilizer import RotationalStabilizer
from rbstab.elements.sliding import SlidingConnector
from rbstab.elements.translational_stabilizer import TranslationalStabilizer
from rbstab.elements.visco_elastic import ViscoElasticConnector
from rbstab.mechanics.motion import motion_from_centre

VECTOR = np.array([1.0, 2.0, 3.0])
NOTHING = np.zeros(3)


@pytest.fixture
def motion(rng):
    return motion_from_centre(random_body(rng), np.zeros(3), random_Z(rng))


def test_element_that_states_nothing_neither_stores_nor_loses(motion):
    element = Element()
    assert element.state_size == 0
    assert element.stored(motion, NO_STATE) == 0
    assert element.dissipated(motion, NO_STATE) == 0
    assert element.rates(motion, NO_STATE).shape == (0,)


def test_element_has_to_state_its_wrench(motion):
    with pytest.raises(NotImplementedError):
        Element().wrench(motion, NO_STATE)


@pytest.mark.parametrize(
    ("wrench", "place"),
    [
        (force_at_centre(VECTOR), "force"),
        (couple_on_body(VECTOR), "couple"),
        (force_at_contact(VECTOR), "contact_force"),
    ],
)
def test_wrench_of_one_force_or_couple(wrench, place):
    expected = dict.fromkeys(("force", "couple", "contact_force"), NOTHING) | {place: VECTOR}
    np.testing.assert_equal(wrench._asdict(), expected)


def test_names_of_the_energy_parts():
    names: dict[type[Element], str] = {
        Gravity: "gravity",
        TranslationalStabilizer: "translational stabilizer",
        RotationalStabilizer: "rotational stabilizer",
        ViscoElasticConnector: "connector",
        EmbeddedConnector: "connector",
        SlidingConnector: "connector",
    }
    assert {kind: kind.name for kind in names} == names


def test_number_of_own_states():
    sizes: dict[type[Element], int] = {
        Gravity: 0,
        TranslationalStabilizer: 0,
        RotationalStabilizer: 0,
        ViscoElasticConnector: 0,
        EmbeddedConnector: 3,
        SlidingConnector: 0,
    }
    assert {kind: kind.state_size for kind in sizes} == sizes


def test_gains_of_one_name_are_declared_alike():
    """Several connectors have K_c and L_c; configs and columns have one unit for each name."""
    declared: dict[str, Gain] = {}
    for element in ELEMENTS:
        for gain in element.gains:
            assert declared.setdefault(gain.name, gain) == gain, (element, gain.name)


def test_the_dampings_of_the_paper_are_declared_to_dissipate():
    """The paper's notation has L for every damping."""
    dampings = [g for element in ELEMENTS for g in element.gains if g.name.startswith("L_")]
    assert {gain.name for gain in dampings} >= {"L_t", "L_r", "L_c", "L_d"}
    assert all(gain.dissipates for gain in dampings)
