"""The nearest rest state: known for the paper's body, and a minimum of the stored energy."""

from dataclasses import replace

import numpy as np
import pytest
from support.rest import HEAVY
from support.rest import paper_system as paper_variant
from support.systems import VARIANTS, random_system

from rbstab.analysis.rest_state import (
    GRADIENT_TOLERANCE,
    RestState,
    in_order,
    nearest_rest_state,
)
from rbstab.mechanics.motion import motion_from_centre
from rbstab.systems.coordinates import (
    CentreCoordinates,
    ContactCoordinates,
    ReducedCoordinates,
)

LOADED = {
    "free": CentreCoordinates(),
    "visco-elastic": ContactCoordinates(),
    "embedded": CentreCoordinates(),
    "permanent": ReducedCoordinates(),
}


def paper_system(coordinates, *connector, weight=HEAVY, anchor=(0.0, 0.0, 0.0)):
    """Return the paper's body in any coordinates with any connector; damping plays no role."""
    free = paper_variant("free", weight=weight, anchor=anchor)
    return replace(free, elements=(*free.elements, *connector), coordinates=coordinates)


@pytest.fixture(params=VARIANTS)
def loaded(request, rng):
    """Return a random system whose weight turns it, but not out of the range of eq. 5."""
    return random_system(rng, request.param, LOADED[request.param])


def test_rest_state_does_not_move_and_is_a_minimum_of_the_stored_energy(loaded, rng):
    rest = nearest_rest_state(loaded)
    assert rest.rests_in_range
    y = loaded.start(rest.motion, rest.element_states)
    # Forces of 100 N, the size of the weight, balance to 1e-10, the last Newton step.
    np.testing.assert_allclose(loaded.rates(y), 0, atol=1e-10)
    assert loaded.potential_energy(y) == pytest.approx(rest.energy, rel=1e-12)
    places = np.r_[0:3, 6:9, 12 : len(y)] if loaded.coordinates.size == 12 else np.r_[0:3]
    for _ in range(20):
        shifted = y.copy()
        shifted[places] += 1e-3 * rng.normal(size=len(places))
        assert loaded.potential_energy(shifted) > rest.energy


@pytest.mark.parametrize("load", [1e-20, 1e-8, 1e10])
def test_a_load_of_any_size_is_balanced(load):
    """A free body rests at X = G/k with the energy -G²/2k."""
    system = paper_system(CentreCoordinates(), weight=load * np.array([0.0, 0.0, -1.0]))
    rest = nearest_rest_state(system)
    assert rest.rests_in_range
    assert rest.is_accurate
    expected = [0.0, 0.0, -load / 3280]
    np.testing.assert_allclose(rest.motion.X, expected, rtol=0, atol=1e-12 * load / 3280)
    assert rest.energy == pytest.approx(-(load**2) / (2 * 3280), rel=1e-12, abs=0)


@pytest.mark.parametrize(
    ("Theta", "inside"),
    [
        ([3.1, 1.5, -3.1], True),
        ([0.0, 1.6, 0.0], False),
        # Upright again, but after a turn.
        ([0.0, 6.2, 0.0], False),
        ([0.0, 0.0, -6.3], False),
    ],
)
def test_a_rest_state_beyond_the_range_is_not_found(Theta, inside):
    system = paper_system(CentreCoordinates(), weight=(0.0, 0.0, 0.0))
    motion = motion_from_centre(system.body, system.anchor, np.array([*Theta, *(0.0,) * 9]))
    assert RestState(motion, np.zeros(0), 0.0, gradient=0.0).rests_in_range is inside
    assert not RestState(motion, np.zeros(0), 0.0, 1.01 * GRADIENT_TOLERANCE).rests_in_range
    assert not RestState(motion, np.zeros(0), 0.0, np.nan).rests_in_range


def test_the_order_of_rest_states_does_not_depend_on_the_last_bits_of_their_energies(rng):
    """Four minima around a maximum, as of a box that leans to each side, with round-off."""
    places = [[-1.3, 0, 0], [0, -1.3, 0], [0, 1.3, 0], [1.3, 0, 0], [0, 0, 0]]
    energies = [-2.8, -2.8, -2.8, -2.8, 0.1]
    for _ in range(5):
        noise = 1 + 1e-14 * rng.uniform(-1, 1, 5)
        shifted = [np.array(place) + 1e-14 * rng.uniform(-1, 1, 3) for place in places]
        order = rng.permutation(5)
        ordered = in_order(order, lambda k: (energies[k] * noise[k], shifted[k]))  # noqa: B023
        assert list(ordered) == [0, 1, 2, 3, 4]
