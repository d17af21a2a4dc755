import numpy as np
import pytest

from rbstab.elements.element import (
    NO_STATE,
    Element,
    couple_on_body,
    force_at_centre,
    force_at_contact,
)
from rbstab.elements.embedded import EmbeddedConnector
from rbstab.elements.gravity import Gravity
from rbstab.elements.rotational_stabilizer import RotationalStabilizer
from rbstab.elements.translational_stabilizer import TranslationalStabilizer
from rbstab.elements.visco_elastic import ViscoElasticConnector

VECTOR = np.array([1.0, 2.0, 3.0])
NOTHING = np.zeros(3)


def test_element_that_states_nothing_neither_stores_nor_loses():
    element = Element()
    assert element.state_size == 0
    assert element.stored(None, NO_STATE) == 0
    assert element.dissipated(None, NO_STATE) == 0
    assert element.rates(None, NO_STATE).shape == (0,)


def test_element_has_to_state_its_wrench():
    with pytest.raises(NotImplementedError):
        Element().wrench(None, NO_STATE)


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
    names = {
        Gravity: "gravity",
        TranslationalStabilizer: "translational stabilizer",
        RotationalStabilizer: "rotational stabilizer",
        ViscoElasticConnector: "connector",
        EmbeddedConnector: "connector",
    }
    assert {kind: kind.name for kind in names} == names
