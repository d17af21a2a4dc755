"""The region of each minimum ends at its pass, and every motion in it converges to the minimum."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq
from support.landscapes import end_of_flow, flooded
from support.problems import problem, solve
from support.proofs import rest_states
from support.rest import HEAVY, inverted_pendulum, paper_system, soft_body

from rbstab.analysis.proof.boxes import RANGE_END
from rbstab.analysis.proof.certified_region import Face, certified_region
from rbstab.analysis.proof.outcome import SearchOutcome
from rbstab.analysis.proof.regions.minimum_regions import minimum_regions

# Bodies with several minima, or whose lowest border point lies behind a saddle: variant, seed.
SOFT = [("permanent", 4), ("visco-elastic", 4), ("visco-elastic", 8), ("visco-elastic", 10)]


def regions_of(system, **options):
    """Return the rest states of a system and the regions of its minima by state."""
    rest = rest_states(system, **options)
    return rest, {one.state: one for one in minimum_regions(rest, certified_region(rest))}


@pytest.fixture(scope="module")
def soft():
    """The rest states and regions of the soft bodies."""
    return {case: regions_of(soft_body(*case)) for case in SOFT}


def valley(stiffness, moment):
    """Return the energy of the pendulum at its leaning rest states: k θ = a sin θ."""
    theta = brentq(lambda x: stiffness * x - moment * np.sin(x), 0.1, np.pi, xtol=1e-14)
    return 0.5 * stiffness * theta**2 - moment * (1 - np.cos(theta))


def test_two_valleys_end_at_the_top_between_them():
    rest, regions = regions_of(inverted_pendulum([50.0, 150.0, 70.0], 100.0))
    assert sorted(regions) == [0, 1]
    for state, region in regions.items():
        assert region.gate.state == 2
        assert region.gate.ends == {0, 1}
        # The top has the energy 0.
        assert region.level == pytest.approx(-rest.states[state].state.energy, abs=1e-12)
        assert -1e-10 < region.energy_bound <= 0
        assert region.lower_bound <= region.level
    assert regions[0].level > 40


def test_two_valleys_end_at_the_half_turn_if_it_is_lower_than_the_top():
    _, regions = regions_of(inverted_pendulum([30.0, 1e3, 1e3], 100.0))
    half_turn = 0.5 * 30.0 * np.pi**2 - 200
    assert half_turn < 0
    for region in regions.values():
        assert region.level == pytest.approx(half_turn - valley(30.0, 100.0), rel=1e-6)
        assert region.energy_bound == pytest.approx(half_turn, rel=1e-8)
    # Each valley ends at its own half turn, which does not lead to the other valley.
    faces = {state: region.gate.face for state, region in regions.items()}
    assert set(faces.values()) == {Face.THETA1_LOW, Face.THETA1_HIGH}
    for state, region in regions.items():
        assert region.gate.ends == {state}


@pytest.mark.parametrize("variant", ["free", "permanent", "visco-elastic", "embedded"])
def test_one_minimum_has_the_region_of_before(variant):
    rest = rest_states(paper_system(variant, weight=HEAVY))
    border = certified_region(rest)
    assert border is not None
    (region,) = minimum_regions(rest, border)
    assert region.state == 0
    assert region.energy_bound == border.energy_bound
    assert region.lower_bound == border.lower_bound
    assert region.gate.face is border.face


@pytest.mark.parametrize("case", SOFT)
def test_no_region_is_smaller_than_before(soft, case):
    rest, regions = soft[case]
    border = certified_region(rest)
    assert border is not None
    before = border.lower_bound
    if before > 0:
        assert regions[0].lower_bound >= before
    for region in regions.values():
        assert 0 < region.lower_bound <= region.level
        assert region.level - region.lower_bound < 1e-5 * abs(rest.states[-1].state.energy)


def test_region_reaches_beyond_a_border_that_lies_behind_a_saddle(soft):
    """The lowest border point is nearer than the saddle in energy, but only beyond the saddle."""
    rest, regions = soft["visco-elastic", 8]
    border = certified_region(rest)
    assert border is not None
    assert border.face is Face.THETA2_HIGH
    assert regions[0].gate.state == 1
    assert regions[0].lower_bound > 1.5 * border.lower_bound
    # There is a region where the border is lower than the minimum.
    rest, regions = soft["visco-elastic", 10]
    border = certified_region(rest)
    assert border is not None
    assert border.level < 0
    assert regions[0].lower_bound > 0.5


@pytest.mark.parametrize("case", SOFT)
def test_no_path_on_a_grid_leaves_a_region(soft, case):
    rest, regions = soft[case]
    for state, region in regions.items():
        lowest = flooded(rest.energy.form, rest, state)
        assert lowest >= region.energy_bound
        # A grid of 0.1 rad is this close to the pass.
        assert lowest - region.energy_bound < 0.05 * max(abs(lowest), 20.0)


@pytest.mark.parametrize("case", SOFT)
def test_flow_from_the_pass_ends_in_the_minimum(soft, case):
    """So the pass belongs to the minimum, and no higher level can be proved."""
    rest, regions = soft[case]
    form = rest.energy.form
    for state, region in regions.items():
        gate = region.gate
        assert gate.Theta is not None
        assert form.value(gate.Theta[np.newaxis])[0] == pytest.approx(region.energy_bound, abs=1e-5)
        if gate.face is None:
            steepest = np.linalg.eigh(form.approximate(gate.Theta[np.newaxis], 2)[2][0])[1][:, 0]
            starts = [gate.Theta + sign * 1e-3 * steepest for sign in (-1, 1)]
        else:
            axis, sign = gate.face.value
            starts = [gate.Theta - sign * 1e-3 * np.eye(3)[axis]]
        apart = [np.abs(end_of_flow(form, s) - rest.states[state].Theta).max() for s in starts]
        assert min(apart) < 1e-4


@pytest.mark.parametrize("case", SOFT)
def test_motions_from_just_below_the_pass_converge_to_the_minimum(soft, case):
    rest, regions = soft[case]
    system = soft_body(*case)
    rng = np.random.default_rng(0)
    followed = 0
    for state, region in regions.items():
        minimum = rest.states[state]
        for direction in rng.normal(size=(4, 3)):
            Theta = _below(rest.energy, minimum.Theta, direction, region)
            q = rest.energy.configuration(Theta)
            start = rest.energy.configurations.state(q)
            run = solve("heyoka", problem(system, start, np.linspace(0, 400, 401)))
            assert (np.abs(run.states[:, :3]) < RANGE_END).all()
            assert run.states[-1, :3] == pytest.approx(minimum.Theta, abs=2e-2)
            followed += 1
    assert followed >= 4


def _below(energy, minimum, direction, region):
    """Return the first point along a ray with 0.9999 of the region's level."""
    rest = energy.form.value(minimum[np.newaxis])[0]
    target = rest + 0.9999 * region.lower_bound
    t = np.linspace(0, 8, 20_001)[1:]
    points = minimum + t[:, np.newaxis] * direction / np.linalg.norm(direction)
    above = np.flatnonzero(energy.form.value(points) > target)
    return points[max(above[0] - 1, 0)]


def test_undecided_boxes_end_all_regions_below_them():
    rest = rest_states(inverted_pendulum([50.0, 150.0, 70.0], 100.0))
    border = certified_region(rest)
    low = np.array([[0.30, 0.1, 0.1]])
    undecided = replace(rest.undecided, low=low, high=low + 1e-3)
    open_rest = replace(rest, undecided=undecided, outcome=SearchOutcome.UNDECIDED)
    U = rest.energy.form.value(np.random.default_rng(0).uniform(low, low + 1e-3, size=(1000, 3)))
    for region in minimum_regions(open_rest, border):
        assert (region.gate.state, region.gate.face, region.gate.Theta) == (None, None, None)
        assert U.min() - 5e-3 < region.energy_bound <= U.min()


def test_state_whose_index_is_not_proved_is_a_gate_and_no_minimum():
    rest = rest_states(inverted_pendulum([50.0, 150.0, 70.0], 100.0))
    first, second, top = rest.states
    doubtful = replace(rest, states=(first, replace(second, index_proved=False), top))
    regions = minimum_regions(doubtful, certified_region(doubtful))
    # Both valleys are equally deep, so nothing is left of the first one either.
    assert all(region.gate.state == 1 and region.lower_bound < 1e-9 for region in regions)


def test_degenerate_rest_state_has_no_region():
    rest = rest_states(inverted_pendulum([100.0, 250.0, 70.0], 100.0))
    assert rest.outcome is SearchOutcome.UNDECIDED
    assert minimum_regions(rest, certified_region(rest)) == ()


def test_search_alone_has_no_region():
    rest = rest_states(paper_system("permanent"), proof=False)
    assert minimum_regions(rest, certified_region(rest)) == ()
    assert minimum_regions(rest, None) == ()


def test_saddle_alone_has_no_region():
    rest, regions = regions_of(inverted_pendulum([150.0, 50.0, 70.0], 100.0))
    assert not rest.states[0].stable
    assert regions == {}
