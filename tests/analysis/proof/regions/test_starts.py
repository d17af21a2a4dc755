"""Many starts at once are proved as each of them alone, whatever the others are."""

import numpy as np
import pytest
from scipy.optimize import brentq
from support.valleys import TWO_VALLEYS

import rbstab
from rbstab.analysis.proof.boxes import Boxes, box_around
from rbstab.analysis.proof.guards.guard import Guard
from rbstab.analysis.proof.guards.soft import SoftEnergy
from rbstab.analysis.proof.regions.downhill import Landscape
from rbstab.analysis.proof.regions.starts import RegionLevel, StartRegions
from rbstab.analysis.proof.trigonometric import TrigonometricForm
from rbstab.experiment.proof import prove
from rbstab.experiment.stored_proof.starts import OPEN_RANGE

RANDOM = np.random.default_rng(11)


@pytest.fixture(scope="module")
def landscape():
    """The energy of a body with two valleys, and the levels of their regions."""
    proof = prove(rbstab.load_config(TWO_VALLEYS))
    corners = [proof.states[region.rest_state - 1].enclosure for region in proof.regions]
    minima = tuple(Boxes(*(np.array([corner]) for corner in pair)) for pair in corners)
    assert proof.reduced_energy is not None
    levels = [region.energy_bound for region in proof.regions]
    return Landscape(proof.reduced_energy.form, minima, OPEN_RANGE), levels


def alone(landscape, levels, energy, low, high):
    """The region of one start, by the test that single runs use."""
    for k, (minimum, level) in enumerate(zip(landscape.minima, levels, strict=True)):
        one = Landscape(landscape.form, (minimum,), landscape.end)
        box = Boxes(low[np.newaxis], high[np.newaxis])
        if energy < level and one.reached_minimum(box, level) is not None:
            return k
    return -1


@pytest.mark.parametrize("lowered", [0.0, 3.0])
def test_each_start_is_proved_as_it_is_alone(landscape, lowered):
    landscape, (first, second) = landscape
    # A region may be taken smaller than it is; then its level is not that of the other one.
    levels = [first, second - lowered]
    regions = StartRegions(landscape, [RegionLevel(k, level) for k, level in enumerate(levels)])
    middle = RANDOM.uniform(-1, 1, (150, 3)) * [3.0, 0.4, 0.4]
    low, high = middle - 1e-12, middle + 1e-12
    energy = landscape.form.value(middle) + RANDOM.uniform(0, 4, 150)
    found = regions.find(energy, low, high)
    starts = zip(energy, low, high, strict=True)
    expected = [alone(landscape, levels, *start) for start in starts]
    assert found.tolist() == expected
    assert set(expected) == {-1, 0, 1}
    # There are starts in a valley whose energy is too large for it, but not for the other one.
    if lowered:
        full = StartRegions(landscape, [RegionLevel(0, first), RegionLevel(1, second)])
        lost = (full.find(energy, low, high) == 1) & (found == -1)
        assert lost.any()
    parts = [
        regions.find(energy[k : k + 1], low[k : k + 1], high[k : k + 1])[0] for k in range(150)
    ]
    assert parts == found.tolist()


def test_boxes_that_are_wide_or_outside_are_not_proved(landscape):
    landscape, levels = landscape
    regions = StartRegions(landscape, [RegionLevel(k, level) for k, level in enumerate(levels)])
    centres = np.array([minimum.centre[0] for minimum in landscape.minima])
    energy = landscape.form.value(centres) + 1e-3
    assert regions.find(energy, centres, centres).tolist() == [0, 1]
    assert regions.find(energy, centres - 0.05, centres + 0.05).tolist() == [0, 1]
    assert regions.find(energy, centres - 2.0, centres + 2.0).tolist() == [-1, -1]
    beyond = centres + np.array([7.0, 0.0, 0.0])
    assert regions.find(energy, beyond, beyond).tolist() == [-1, -1]
    assert regions.find(np.full(2, np.nan), centres, centres).tolist() == [-1, -1]
    assert regions.find(energy, centres, centres - 1e-9).tolist() == [-1, -1]


def test_no_regions(landscape):
    landscape, _ = landscape
    found = StartRegions(landscape, []).find(np.array([-1e9]), np.zeros((1, 3)), np.zeros((1, 3)))
    assert found.tolist() == [-1]


def test_no_start_is_proved_by_a_way_beyond_a_stop():
    """Two valleys with a pass beside the stop: beyond the stop, a lower way would join them.

    U = ½ (0.2 θ1² + 8 θ2² + 2 θ3²) + cos 2θ1 cos 4θ2 - 0.3 sin θ1 with |θ2| <= 0.27. On the plane
    of θ1 through the saddle at the stop U is above the level, so a start goes to its own side.
    """
    C, stop = np.zeros((9, 9, 9)), 0.27
    C[3, 7, 0], C[2, 0, 0] = 1.0, -0.3
    guard = Guard(None, (SoftEnergy(np.inf, 0.0, stop),))
    form = TrigonometricForm(np.diag([0.2, 8.0, 2.0]), np.zeros(3), C, guard=guard)

    # At θ2 = 0, ∂U/∂θ1 = 0.2 θ1 - 2 sin 2θ1 - 0.3 cos θ1; at the stop cos 4θ2 is a factor of it.
    def slope(roll, pitch):
        return 0.2 * roll - 2 * np.sin(2 * roll) * np.cos(4 * pitch) - 0.3 * np.cos(roll)

    rolls = [brentq(slope, *ends, args=(0.0,), xtol=1e-15) for ends in ((-2.5, -1), (1, 2.5))]
    minima = [np.array([roll, 0.0, 0.0]) for roll in rolls]
    border = brentq(slope, -0.9, 0.9, args=(stop,), xtol=1e-15)
    # Along θ2 the minima are minima, and the stop holds what presses against it.
    assert all(8 - 16 * np.cos(2 * roll) > 0 for roll in rolls)
    assert 8 * stop - 4 * np.cos(2 * border) * np.sin(4 * stop) < 0
    level = float(form.value(np.array([[border, stop, 0.0]]))[0]) - 1e-6
    pitch = np.linspace(-stop, stop, 1001)
    plane = np.stack([np.full(1001, border), pitch, np.zeros(1001)], axis=1)
    assert form.value(plane).min() > level
    rng = np.random.default_rng(0)
    middle = rng.uniform([border - 0.5, 0.265, -0.2], [border + 0.5, stop, 0.2], size=(600, 3))
    energy = form.value(middle)
    middle, energy = middle[energy < level - 1e-6], energy[energy < level - 1e-6]
    for end in (OPEN_RANGE, np.array([np.pi, guard.end, np.pi])):
        landscape = Landscape(form, tuple(box_around(x, 1e-9) for x in minima), end)
        regions = StartRegions(landscape, [RegionLevel(0, level), RegionLevel(1, level)])
        reached = regions.find(energy + 1e-9, middle - 1e-12, middle + 1e-12)
        assert np.all(reached >= 0)
        sides = np.array([x[0] > border for x in minima])
        assert np.array_equal(sides[reached], middle[:, 0] > border)
