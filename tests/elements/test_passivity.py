"""Every element of the registry is passive: power in = change of stored energy + dissipation.

A new element in the registry is tested too, with random gains made from those it declares.
"""

from functools import partial

import numpy as np
import pytest
from support.differences import derivative, relative_error
from support.elements import CASES, SWITCHING_CASES, case_id, random_element
from support.path import random_path
from support.systems import random_body, random_Z

from rbstab.elements.declarations import Gain
from rbstab.elements.registry import ELEMENTS
from rbstab.mechanics.derivatives import jacobian
from rbstab.mechanics.motion import motion_from_centre

STATES = 20
"""The number of random states for each random element."""

EVERY = CASES + SWITCHING_CASES
POTENTIALS = [case for case in EVERY if case[1].has_potential]


@pytest.fixture(params=EVERY, ids=case_id)
def case(request):
    return request.param


@pytest.fixture
def element(rng, case):
    return random_element(rng, *case)


def random_states(rng, element):
    """Return bodies, anchors, motions Z and own states of the element."""
    return [
        (random_body(rng), rng.normal(size=3), random_Z(rng), rng.normal(size=element.state_size))
        for _ in range(STATES)
    ]


@pytest.fixture
def states(rng, element):
    return random_states(rng, element)


def power_on_body(wrench, motion):
    """Return the power of a wrench on the body, W."""
    turning = wrench.couple @ motion.Omega
    return wrench.force @ motion.V + turning + wrench.contact_force @ motion.F


def assert_balanced(element, motion, element_states, stored_rate, tolerance):
    """Assert that the element stores what it takes from the body and does not dissipate."""
    taken_in = -power_on_body(element.wrench(motion, element_states), motion)
    lost = element.dissipated(motion, element_states)
    scale = abs(taken_in) + abs(lost) or 1.0  # some elements do nothing in some modes
    assert relative_error(stored_rate, taken_in - lost, scale) < tolerance


@pytest.mark.parametrize("case", POTENTIALS, ids=case_id)
def test_power_is_stored_or_dissipated_along_a_path(rng, case):
    """The same for a body on a given path, whose spin and velocity are found by differences."""
    element = random_element(rng, *case)

    def rate_of_the_energy(path, anchor, element_states):
        state_rates = element.rates(motion_from_centre(path.body, anchor, path.Z()), element_states)

        def stored(t):
            motion = motion_from_centre(path.body, anchor, path.Z(t))
            return element.stored(motion, element_states + t * state_rates)

        return derivative(stored, 5e-3 * case[1].step)

    for _ in range(STATES):
        path, anchor = random_path(rng, random_body(rng)), rng.normal(size=3)
        element_states = rng.normal(size=element.state_size)
        motion = motion_from_centre(path.body, anchor, path.Z())
        assert_balanced(
            element, motion, element_states, rate_of_the_energy(path, anchor, element_states), 1e-9
        )


def test_loss_is_positive_while_anything_moves(rng, element, states, case):
    """An element dissipates exactly if it is damped, and never less than nothing."""
    damped = case[1].loses
    if damped is None:
        damped = any(gain.dissipates for gain in element.gains)
    for body, anchor, Z, element_states in states:
        # Slow and fast motions: each term of the dissipation is the largest in some of them.
        Z[[3, 4, 5, 9, 10, 11]] *= 10.0 ** rng.uniform(-3, 3)
        lost = element.dissipated(motion_from_centre(body, anchor, Z), element_states)
        assert lost > 0 if damped else lost == 0


def test_nothing_is_lost_at_rest(element, states):
    for body, anchor, Z, start in states:
        still = np.concatenate([Z[0:3], np.zeros(3), Z[6:9], np.zeros(3)])
        motion, element_states = motion_from_centre(body, anchor, still), start
        # Own states rest where their rates vanish: by Newton's method, exact for linear rates.
        for _ in range(12 if element.state_size else 0):
            slope = jacobian(partial(element.rates, motion), element_states)
            element_states = element_states - np.linalg.solve(
                slope, element.rates(motion, element_states)
            )
        scale = element.dissipated(motion_from_centre(body, anchor, Z), element_states)
        assert abs(element.dissipated(motion, element_states)) <= 1e-20 * scale


def test_gains_of_one_name_are_declared_alike():
    """Several connectors have K_c and L_c; the paper's notation has L for every damping."""
    declared: dict[str, Gain] = {}
    for element in ELEMENTS:
        for gain in element.gains:
            assert declared.setdefault(gain.name, gain) == gain, (element, gain.name)
            assert gain.dissipates == gain.name.startswith("L_")
    assert set(declared) >= {"L_t", "L_r", "L_c", "L_d"}
