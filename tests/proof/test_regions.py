"""The region of each minimum ends at its pass, and every motion in it converges to the minimum."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq
from support.hang_guard import within
from support.landscapes import end_of_flow, flooded
from support.problems import problem, solve
from support.proofs import body_of, energies_of, regions_of, rest_states, slopes_of
from support.rest import HEAVY, inverted_pendulum, paper_system, random_rest_system, soft_body

from rbstab.elements.gravity import Gravity
from rbstab.elements.rotational_stabilizer import RotationalStabilizer
from rbstab.proof.boxes import Box, Boxes
from rbstab.proof.model import RANGE_END
from rbstab.proof.regions.regions import regions_of as regions_in
from rbstab.proof.regions.starts import RegionLevel, StartRegions
from rbstab.proof.rest_points import SearchOutcome
from rbstab.proof.search import Zeros

# Bodies with several minima, or whose lowest border point lies behind a saddle: variant, seed.
SOFT = [("permanent", 4), ("visco-elastic", 4), ("visco-elastic", 8), ("visco-elastic", 10)]


def of_minima(system, **options):
    """Return the rest states of a system and the regions of its minima by state."""
    rest = rest_states(system, **options)
    return rest, {one.state: one for one in regions_of(rest).minima}


@pytest.fixture(scope="module")
def soft():
    """The rest states and regions of the soft bodies."""
    return {case: of_minima(soft_body(*case)) for case in SOFT}


def valley(stiffness, moment):
    """Return the energy of the pendulum at its leaning rest states: k θ = a sin θ."""
    theta = brentq(lambda x: stiffness * x - moment * np.sin(x), 0.1, np.pi, xtol=1e-14)
    return 0.5 * stiffness * theta**2 - moment * (1 - np.cos(theta))


def test_two_valleys_end_at_the_top_between_them():
    rest, regions = of_minima(inverted_pendulum([50.0, 150.0, 70.0], 100.0))
    assert sorted(regions) == [0, 1]
    for state, region in regions.items():
        assert region.pass_state == 2
        # The top has the energy 0.
        depth = -rest.states[state].state.energy
        assert region.level == pytest.approx(depth, abs=1e-12)
        assert -2e-6 * depth < region.energy_bound <= 0
        assert region.lower_bound <= region.level
    assert regions[0].level > 40


def test_two_valleys_end_at_the_half_turn_if_it_is_lower_than_the_top():
    _, regions = of_minima(inverted_pendulum([30.0, 1e3, 1e3], 100.0))
    half_turn = 0.5 * 30.0 * np.pi**2 - 200
    assert half_turn < 0
    depth = half_turn - valley(30.0, 100.0)
    for region in regions.values():
        assert region.level == pytest.approx(depth, rel=1e-6)
        assert region.energy_bound == pytest.approx(half_turn, abs=2e-6 * depth)
    # Each valley ends at its own half turn, which does not lead to the other valley.
    assert {region.pass_face for region in regions.values()} == {(0, -1), (0, 1)}


def test_a_valley_so_shallow_that_round_off_hides_its_pass_ends_the_search():
    """With springs of 1e-6 N m/rad, the valleys of the hanging top differ by 1e-14 J."""
    rest = rest_states(inverted_pendulum([1e-6, 1e-6, 1e-6], 0.2943))
    regions = within(120, regions_of, rest)
    # A lean by π stores ½ 1e-6 π² J, and hangs 2 · 0.2943 J lower than upright.
    lowest = 0.5e-6 * np.pi**2 - 2 * 0.2943
    assert rest.states[0].state.energy == pytest.approx(lowest, abs=1e-9)
    for region in regions.minima:
        assert 0 < region.lower_bound <= region.level < 1e-5


@pytest.mark.parametrize("variant", ["free", "permanent", "visco-elastic", "embedded"])
def test_one_minimum_has_the_certified_region(variant):
    found = regions_of(rest_states(paper_system(variant, weight=HEAVY)))
    assert found.certified is not None
    (region,) = found.minima
    assert region.state == 0
    assert region.energy_bound == found.certified.energy_bound
    assert region.lower_bound == found.certified.lower_bound
    assert region.pass_face == found.certified.face


@pytest.mark.parametrize("case", SOFT)
def test_no_region_is_smaller_than_the_certified_one(soft, case):
    rest, regions = soft[case]
    certified = regions_of(rest).certified
    assert certified is not None
    if certified.lower_bound > 0:
        assert regions[0].lower_bound >= certified.lower_bound
    for region in regions.values():
        assert 0 < region.lower_bound <= region.level
        assert region.level - region.lower_bound < 2e-3 * region.level


def test_region_reaches_beyond_a_border_that_lies_behind_a_saddle(soft):
    """The lowest border point is nearer than the saddle in energy, but only beyond the saddle."""
    rest, regions = soft["visco-elastic", 8]
    certified = regions_of(rest).certified
    assert certified is not None
    assert certified.face == (1, 1)
    assert regions[0].pass_state == 1
    assert regions[0].lower_bound > 1.5 * certified.lower_bound
    # There is a region where the border is lower than the minimum.
    rest, regions = soft["visco-elastic", 10]
    certified = regions_of(rest).certified
    assert certified is not None
    assert certified.level < 0
    assert regions[0].lower_bound > 0.5


@pytest.mark.parametrize("case", SOFT)
def test_no_path_on_a_grid_leaves_a_region(soft, case):
    rest, regions = soft[case]
    for state, region in regions.items():
        lowest = flooded(lambda Theta: energies_of(rest, Theta), rest, state)
        assert lowest >= region.energy_bound
        # A grid of 0.1 rad is this close to the pass.
        assert lowest - region.energy_bound < 0.05 * max(abs(lowest), 20.0)


@pytest.mark.parametrize("case", SOFT)
def test_motions_from_just_below_the_pass_converge_to_the_minimum(soft, case):
    rest, regions = soft[case]
    system = soft_body(*case)
    body, rng, followed = body_of(system), np.random.default_rng(0), 0
    for state, region in regions.items():
        minimum = rest.states[state]
        for direction in rng.normal(size=(4, 3)):
            Theta = _below(rest, minimum.Theta, direction, region)
            start = body.at_rest.state(body.configuration(Theta))
            run = solve("heyoka", problem(system, start, np.linspace(0, 400, 401)))
            assert (np.abs(run.states[:, :3]) < RANGE_END).all()
            assert run.states[-1, :3] == pytest.approx(minimum.Theta, abs=2e-2)
            followed += 1
    assert followed >= 4


def _below(rest, minimum, direction, region):
    """Return the first point along a ray with 0.9999 of the region's level."""
    target = energies_of(rest, minimum[np.newaxis])[0] + 0.9999 * region.lower_bound
    t = np.linspace(0, 8, 20_001)[1:]
    points = minimum + t[:, np.newaxis] * direction / np.linalg.norm(direction)
    above = np.flatnonzero(energies_of(rest, points) > target)
    return points[max(above[0] - 1, 0)]


def _with_zeros(rest, zeros):
    """Return the regions of a body with another list of rest states."""
    body = body_of(inverted_pendulum([50.0, 150.0, 70.0], 100.0))
    return regions_in(body.energy, zeros, Box(-rest.end, rest.end), body.bounded)


def test_undecided_boxes_end_all_regions_below_them():
    rest = rest_states(inverted_pendulum([50.0, 150.0, 70.0], 100.0))
    low = np.array([[0.30], [0.1], [0.1]])
    found = _with_zeros(rest, replace(rest.zeros, undecided=Boxes(low, low + 1e-3)))
    points = np.random.default_rng(0).uniform(low.T, low.T + 1e-3, size=(1000, 3))
    U = energies_of(rest, points)
    assert found.minima
    for region in found.minima:
        assert region.pass_state is None
        assert U.min() - 5e-3 < region.energy_bound <= U.min()


def test_state_whose_index_is_not_proved_has_no_region():
    rest = rest_states(inverted_pendulum([50.0, 150.0, 70.0], 100.0))
    first, second, top = rest.zeros.zeros
    doubtful = Zeros((first, replace(second, index=None), top), rest.zeros.undecided, 0)
    assert all(region.state == 0 for region in _with_zeros(rest, doubtful).minima)


def test_degenerate_rest_state_has_no_region():
    rest = rest_states(inverted_pendulum([100.0, 250.0, 70.0], 100.0))
    assert rest.outcome is SearchOutcome.UNDECIDED
    assert regions_of(rest).minima == ()


def test_search_alone_has_no_region():
    found = regions_of(rest_states(paper_system("permanent"), proof=False))
    assert found.minima == ()
    assert found.certified is None or found.certified.energy_bound is None


def test_saddle_alone_has_no_region():
    rest, regions = of_minima(inverted_pendulum([150.0, 50.0, 70.0], 100.0))
    assert not rest.states[0].stable
    assert regions == {}


def loaded_body(seed):
    """Return a random body, soft against rotation, under up to six times its weight."""
    rng = np.random.default_rng(seed)
    system = random_rest_system(rng, rng.choice(["permanent", "visco-elastic", "embedded"]))
    gravity, translational, rotational, *connector = system.elements
    assert isinstance(gravity, Gravity)
    assert isinstance(rotational, RotationalStabilizer)
    softness, load = 10 ** rng.uniform(-2.5, -0.3), 10 ** rng.uniform(-0.5, 0.8)
    soft = RotationalStabilizer(softness * rotational.K_r, rotational.L_r)
    elements = (Gravity(load * gravity.weight), translational, soft, *connector)
    return replace(system, elements=elements)


def points_near(rest, rng, count=25):
    """Return points in the range, near minima and saddles of index 1."""
    centres = [point.Theta for point in rest.states if point.index < 2]
    scales = 10 ** rng.uniform(-1.5, 0.2, size=(count, 1))
    points = rng.choice(centres, size=count) + scales * rng.normal(size=(count, 3))
    return points[np.all(np.abs(points) < 0.999 * RANGE_END, axis=1)]


@pytest.mark.long
def test_no_region_of_a_random_body_can_be_left_and_no_start_is_in_a_wrong_one():
    regions, several, tested = 0, 0, 0
    for seed in range(2000, 2012):
        system = loaded_body(seed)
        rest = rest_states(system, box_limit=60_000)
        found = regions_of(rest).minima
        regions, several = regions + len(found), several + (len(found) > 1)
        points = points_near(rest, np.random.default_rng(seed))
        energies = energies_of(rest, points)
        levels = [RegionLevel(one.state, one.energy_bound) for one in found]
        box = Box(-rest.end, rest.end)
        starts = StartRegions(body_of(system).energy, rest.zeros, box, levels)
        for region in found:
            level = flooded(
                lambda x, rest=rest: energies_of(rest, x), rest, region.state, (41, 25, 41)
            )
            assert level >= region.energy_bound
        for Theta, k in zip(points, starts.find(energies, points, points), strict=True):
            if k >= 0:
                end = end_of_flow(lambda x, rest=rest: slopes_of(rest, x), Theta)
                assert end == pytest.approx(rest.states[found[k].state].Theta, abs=1e-2)
                tested += 1
    assert regions > 6
    assert several > 0
    assert tested > 10
