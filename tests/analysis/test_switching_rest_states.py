"""Rest states and energies of bodies with switching elements use the modes of each configuration.

A mass hangs on a ligament: its elongation at rest follows from the load by the inverse of the
tension, in the toe or beyond it, wherever the motion started.
"""

import numpy as np
import pytest
from support.switching import MASS, data, ligament, problem

from rbstab.analysis.rest_state import nearest_rest_state

K, TOE = 80.0, 0.05


def hanging(weight, x):
    """Return a mass that a load pulls along a damped ligament; stabilizers hold its attitude."""
    controller = {"variant": "free", "K_t": [1e-3, 50, 50], "L_t": [3, 4, 5]}
    controller |= {"K_r": [30, 40, 50], "L_r": [3, 4, 5]}
    return data(
        {"a": ligament(-1.0, stiffness=K, toe_strain=TOE)},
        {"position": [x, 0, 0]},
        controller=controller,
        gravity=[weight / MASS, 0, 0],
    )


def position_at_rest(weight):
    """Return x at rest: the spring K_t along x takes 1e-3 x of the load."""
    x = 0.0
    for _ in range(50):
        load = weight - 1e-3 * x
        strain = np.sqrt(4 * TOE * load / K) if load < K * TOE else TOE + load / K
        x = 0.3 + strain
    return x


@pytest.mark.parametrize("weight", [1.0, 3.9, 4.1, 20.0])
@pytest.mark.parametrize("x", [0.0, 0.9])
def test_rest_position_of_a_hanging_mass(weight, x):
    system = problem(hanging(weight, x)).system
    rest = nearest_rest_state(system)
    assert rest.rests_in_range
    assert abs(rest.motion.X[0] - position_at_rest(weight)) < 1e-6
