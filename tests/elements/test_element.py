"""An element without statements does nothing, and the known elements keep their names and sizes."""

import numpy as np
import pytest
from support.systems import random_body, random_Z

from rbstab.elements.declarations import Gain
from rbstab.elements.element import (
    NO_STATE,
    Element,
)
from rbstab.elements.registry import ELEMENTS
from rbstab.mechanics.motion import motion_from_centre


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
