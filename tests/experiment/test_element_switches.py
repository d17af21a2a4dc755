"""Whether an element may switch just at a rest state: never denied where it does.

The places are found by SciPy with the stored energy of the system itself.
"""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import brentq, minimize
from support.leg import held_leg
from support.proofs import energy_of_config

from rbstab.analysis.configuration import configurations
from rbstab.config.build import problem_of
from rbstab.config.load import load_config
from rbstab.elements.ligament import Ligament
from rbstab.experiment.stored_proof.almost_every_start import may_switch

CONFIGS = Path(__file__).parents[2] / "configs"
NARROW = 1e-9


def leg(slack_length):
    """A leg that is held at its knee, with a rope above it that is 0.5 m long while it stands."""
    rope = {"kind": "ligament", "point": [0, 0, 0.3], "anchor": [0, 0, 0.8], "stiffness": 30}
    rope |= {"slack_length": slack_length, "toe_strain": 0.03}
    return load_config(held_leg(elements={"rope": rope}))


def may_be(config, Theta, radius=NARROW, energy=None):
    """Return whether the ligament of a config may be just taut in a cube about Θ."""
    box = np.array([Theta - radius, Theta + radius])
    proof: Any = SimpleNamespace(reduced_energy=energy)
    state: Any = SimpleNamespace(enclosure=box)
    return may_switch(proof, state, config, next(iter(config.elements)), 1)


@pytest.mark.parametrize(("slack", "expected"), [(0.5, True), (0.51, False), (0.49, False)])
def test_the_rope_of_a_held_leg(slack, expected):
    config = leg(slack)
    assert may_be(config, np.zeros(3)) is expected
    # In a wide box it may be: the rope is longer where the leg leans.
    assert may_be(config, np.zeros(3), 1.0) is (slack >= 0.5)


@pytest.fixture(scope="module")
def tied():
    return load_config(CONFIGS / "examples" / "ligament_proved.yaml")


def strain(config, Theta):
    """Return the strain of the ligament where the energy is least over the position."""
    at_rest = configurations(problem_of(config).system)
    (band,) = (element for element in at_rest.system.elements if isinstance(element, Ligament))

    def energy(X):
        return at_rest.energy(np.concatenate([Theta, X]))

    def slope(X):
        return at_rest.gradient(np.concatenate([Theta, X]))[3:]

    X = minimize(energy, np.zeros(3), jac=slope, method="BFGS", options={"gtol": 1e-11}).x
    return band.guards(at_rest.motion(np.concatenate([Theta, X])), np.zeros(0))[0]


def test_the_ligament_of_a_tied_body(tied):
    """Along a way of attitudes it goes taut: before and behind this place it is not just taut."""
    energy = SimpleNamespace(energy=energy_of_config(tied))
    begin, way = np.array([0.1, -0.2, 0.05]), np.array([0.0, 1.0, 0.1])
    at = brentq(lambda s: strain(tied, begin + s * way), 0.0, 0.5, xtol=1e-12)
    for s, expected in ((at, True), (at - 0.01, False), (at + 0.01, False)):
        assert may_be(tied, begin + s * way, 1e-6, energy) is expected
    # It is not known where another energy is least.
    other = SimpleNamespace(energy=SimpleNamespace(U=energy.energy.U + 1))
    assert may_be(tied, begin + (at + 0.01) * way, 1e-6, other)
