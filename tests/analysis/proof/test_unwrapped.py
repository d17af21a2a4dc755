"""For all real θ1 and θ3 the rest states are bounded, and none is missed beyond the range."""

from dataclasses import replace

import numpy as np
import pytest
from rbstab.analysis.proof.regions.minimum_regions import minimum_regions
from scipy.optimize import root
from support.proofs import rest_states, unwrapped_rest_states
from support.rest import HEAVY, inverted_pendulum, paper_system, random_rest_system

from rbstab.analysis.proof.boxes import RANGE_END
from rbstab.analysis.proof.certified_region import Face, certified_region
from rbstab.analysis.proof.outcome import SearchOutcome
from rbstab.analysis.proof.reduced_energy import reduced_energy
from rbstab.analysis.proof.trigonometric import TrigonometricForm
from rbstab.analysis.proof.unwrapped import unwrapped_end


def unwrapped(system):
    found = unwrapped_rest_states(rest_states(system))
    assert found is not None
    return found


@pytest.mark.parametrize("weight", [(0.0, 0.0, 0.0), HEAVY])
@pytest.mark.parametrize("variant", ["free", "permanent", "visco-elastic", "embedded"])
def test_paper_bodies_have_one_rest_state_in_all(variant, weight):
    rest = rest_states(paper_system(variant, weight=weight))
    found = unwrapped(paper_system(variant, weight=weight))
    assert found.unique is True
    assert found.states[0].index_proved
    np.testing.assert_array_equal(found.states[0].Theta, rest.states[0].Theta)
    assert np.all(found.end >= RANGE_END)
    inner, wide = certified_region(rest), certified_region(found)
    assert inner is not None
    assert wide is not None
    # θ1 = ±π and θ3 = ±π do not bound it; for these bodies θ2 = ±π/2 is lower anyway.
    assert wide.face in {Face.THETA2_LOW, Face.THETA2_HIGH}
    assert wide.energy == pytest.approx(inner.energy, rel=1e-12)


def test_rest_states_of_a_turning_pendulum():
    """k θ = a sin θ at θ2 = θ3 = 0 has a new pair of roots for each further turn."""
    found = unwrapped(inverted_pendulum([12.0, 400.0, 400.0], 100.0))
    assert found.outcome is SearchOutcome.PROVED
    grid = np.linspace(-20, 20, 400_001)
    signs = np.sign(12.0 * grid - 100 * np.sin(grid))
    crossings = grid[:-1][signs[:-1] * signs[1:] < 0]
    near_zero = [0.0] if not np.any(np.abs(crossings) < 1e-3) else []
    expected = np.sort([*crossings, *near_zero])
    on_axis = [p.Theta[0] for p in found.states if np.abs(p.Theta[1:]).max() < 1e-9]
    np.testing.assert_allclose(np.sort(on_axis), expected, atol=2e-4)
    assert max(np.abs(expected)) > np.pi
    assert found.end[0] > max(np.abs(expected))


def test_the_same_box_is_not_searched_twice():
    """Nothing of a stiff body is at rest beyond a half turn, so the range of eq. 5 has all."""
    stiff = rest_states(inverted_pendulum([400.0, 400.0, 400.0], 100.0))
    np.testing.assert_array_equal(stiff.end, RANGE_END)
    assert unwrapped_rest_states(stiff) is stiff
    soft = rest_states(inverted_pendulum([12.0, 400.0, 400.0], 100.0))
    assert unwrapped_rest_states(soft) is not soft


def test_half_turn_does_not_bound_a_region_without_wrapping():
    rest = rest_states(inverted_pendulum([30.0, 1e3, 1e3], 100.0))
    found = unwrapped(inverted_pendulum([30.0, 1e3, 1e3], 100.0))
    inner = minimum_regions(rest, certified_region(rest))
    wide = minimum_regions(found, certified_region(found))
    assert {region.gate.face for region in inner} == {Face.THETA1_LOW, Face.THETA1_HIGH}
    # The valleys now end at the top between them, at 0 J.
    assert [region.gate.state for region in wide] == [2, 2]
    assert all(-1e-6 < region.energy_bound <= 0 for region in wide)


@pytest.mark.parametrize("variant", ["permanent", "visco-elastic", "embedded"])
def test_no_root_is_beyond_the_end(rng, variant):
    """Roots of the gradient from far starts, by SciPy, with θ2 inside its range."""
    seen = 0
    for _ in range(3):
        form = reduced_energy(random_rest_system(rng, variant)).form
        end = unwrapped_end(form)
        assert end is not None
        for start in rng.uniform(-2 * end, 2 * end, size=(100, 3)) * [1, 0.5, 1]:
            ended = root(lambda x, U=form: U.approximate(x[None], 1)[1][0], start, tol=1e-12)
            if ended.success and abs(ended.x[1]) < np.pi / 2:
                assert np.all(np.abs(ended.x) <= end)
                seen += 1
    assert seen > 5


def test_bound_is_sharp_for_one_wave():
    # ∂U/∂θ1 = 2 θ1 + 6 cos θ1 + 1; |θ1| <= (6 + 1) / 2 up to the margin.
    coefficients = np.zeros((3, 3, 3))
    coefficients[2, 0, 0] = 6.0
    form = TrigonometricForm(np.diag([2.0, 1, 4]), np.array([1.0, 0, 0]), coefficients)
    end = unwrapped_end(form)
    assert end is not None
    top = 0.5 * (np.pi / 2) ** 2
    climb = np.sqrt(2 * (6 + top) / 2)
    assert climb < 3.5
    assert end[0] == pytest.approx(3.5, rel=2e-3)
    assert end[0] > 3.5
    assert end[2] == RANGE_END[2]


def test_coupling_with_the_second_angle_counts():
    # θ1 + θ2 = 4 with θ2 down to -π/2.
    Q = np.eye(3)
    Q[0, 1] = Q[1, 0] = 1.0
    Q[1, 1] = 5.0
    form = TrigonometricForm(Q, np.array([-4.0, 0, 0]), np.zeros((1, 1, 1)))
    end = unwrapped_end(form)
    assert end is not None
    assert end[0] >= 4 + np.pi / 2


def test_spring_that_is_not_definite_gives_no_bound():
    for entries in ([1.0, 1.0, 0.0], [-1.0, 1.0, 1.0], [0.0, 1.0, 1.0]):
        form = TrigonometricForm(np.diag(entries), np.zeros(3), np.zeros((1, 1, 1)))
        assert unwrapped_end(form) is None
    Q = np.eye(3)
    Q[0, 2] = Q[2, 0] = 1.0
    assert unwrapped_end(TrigonometricForm(Q, np.zeros(3), np.zeros((1, 1, 1)))) is None


def test_very_soft_body_is_not_searched():
    assert unwrapped_rest_states(rest_states(paper_system("permanent", 0.01))) is None


def test_rounding_of_large_angles_is_counted(rng):
    """The quadratic part grows with the angles, and so does the bound of its rounding."""
    root_ = rng.normal(size=(3, 3))
    form = TrigonometricForm(root_ @ root_.T, rng.normal(size=3), rng.normal(size=(5, 5, 5)))
    wide = replace(form, reach=400.0)
    for level, growth in ((0, 1000), (1, 10)):
        assert np.all(wide.round_off[level] > growth * form.round_off[level] * 0.01)
    assert wide.round_off[0] > 100 * form.round_off[0]
    np.testing.assert_array_equal(wide.round_off[3], form.round_off[3])
