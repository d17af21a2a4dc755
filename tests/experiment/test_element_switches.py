"""Whether an element may switch just at a rest state: never denied where it does."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from support.leg import held_leg

from rbstab.config.load import load_config
from rbstab.experiment.stored_proof.switches import may_switch

CONFIGS = Path(__file__).parents[2] / "configs"
NARROW = 1e-9


def leg(slack_length):
    """A leg that is held at its knee, with a rope above it that is 0.5 m long while it stands."""
    rope = {"kind": "ligament", "point": [0, 0, 0.3], "anchor": [0, 0, 0.8], "stiffness": 30}
    rope |= {"slack_length": slack_length, "toe_strain": 0.03}
    return load_config(held_leg(elements={"rope": rope}))


def may_be(config, Theta, radius=NARROW):
    """Return whether the ligament of a config may be just taut in a cube about Θ."""
    state: Any = SimpleNamespace(enclosure=np.array([Theta - radius, Theta + radius]))
    return may_switch(state, config, next(iter(config.elements)), 1)


@pytest.mark.parametrize(("slack", "expected"), [(0.5, True), (0.51, False), (0.49, False)])
def test_the_rope_of_a_held_leg(slack, expected):
    config = leg(slack)
    assert may_be(config, np.zeros(3)) is expected
    # In a wide box it may be: the rope is longer where the leg leans.
    assert may_be(config, np.zeros(3), 1.0) is (slack >= 0.5)


def test_of_the_ligament_of_a_tied_body_it_is_not_known():
    """Its strain depends on the position too."""
    tied = load_config(CONFIGS / "examples" / "ligament_proved.yaml")
    assert may_be(tied, np.array([0.1, -0.2, 0.05]))
